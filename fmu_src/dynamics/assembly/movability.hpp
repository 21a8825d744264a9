#pragma once

#include <string>

#include "dynamics/workspace.hpp"

namespace redysim {

// The first joint, from the leaves, whose articulated inertia at q is nothing but rounding: the joints from
// here to the leaves can move without moving mass or inertia, and the mass matrix is singular. -1: none.
// Prescribed joints need no inertia. Overwrites the workspace; allocates.
int singular_joint(const Plan<double>& plan, Workspace<double>& ws, const double* q);

// The same for all poses but special ones.
int always_singular_joint(const Plan<double>& plan, Workspace<double>& ws);

// "joint 'elbow': the mass matrix is singular, ..." with what to do; `where`: " at the start pose" or empty.
std::string singular_sentence(const Model& model, const Plan<double>& plan, int joint, const char* where);

}  // namespace redysim
