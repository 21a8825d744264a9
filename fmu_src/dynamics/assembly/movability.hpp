#pragma once

#include <vector>

#include "dynamics/workspace.hpp"

namespace redysim {

// Articulated inertia of each joint about its axis at q, at rest, without loops (kg m^2 or kg); 0: zero
// within rounding. Overwrites the workspace; allocates.
std::vector<double> joint_inertias(const Plan<double>& plan, Workspace<double>& ws, const double* q);

// The first joint, from the leaves, whose articulated inertia about its axis at q is zero within rounding;
// -1: none. This joint and outboard ones can then move without moving mass or inertia, and the mass matrix is
// singular. Prescribed joints need no inertia. Overwrites the workspace; allocates.
int singular_joint(const Plan<double>& plan, Workspace<double>& ws, const double* q);

// The first joint that is singular in almost all configurations; -1: none.
int always_singular_joint(const Plan<double>& plan, Workspace<double>& ws);

}  // namespace redysim
