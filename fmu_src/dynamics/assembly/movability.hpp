#pragma once

#include <vector>

#include "dynamics/workspace.hpp"

namespace redysim {

// The articulated inertia of each joint about its axis at q, at rest, without loops (kg m^2 or kg); 0: zero
// within rounding. Overwrites the workspace; allocates.
std::vector<double> joint_inertias(const Plan<double>& plan, Workspace<double>& ws, const double* q);

// The first joint, from the leaves, whose articulated inertia about its axis at q is zero within rounding:
// this joint and outboard ones can move without moving mass or inertia, and the mass matrix is singular. -1:
// none. Prescribed joints need no inertia. Overwrites the workspace; allocates.
int singular_joint(const Plan<double>& plan, Workspace<double>& ws, const double* q);

// The same for almost all configurations.
int always_singular_joint(const Plan<double>& plan, Workspace<double>& ws);

}  // namespace redysim
