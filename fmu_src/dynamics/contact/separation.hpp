#pragma once

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"

namespace redysim {

// Lower bound of the distance of a pair, m; negative: it may touch. Excludes distant contacts by the distance
// between the sphere around the contact points and the box or half space around the surface. Uses the ground
// poses in the workspace. Instantiated for double and Dual.
template <class Scalar>
Scalar separation(const ContactPair<Scalar>& pair, const Workspace<Scalar>& ws);

}  // namespace redysim
