#pragma once

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"

namespace redysim {

// Excludes contacts that are far away: not more than the distance (m; negative: none) between the sphere that
// contains the contact points of a pair and the box, or the half space, that contains the surface. Uses the
// ground poses in the workspace. Instantiated for double and Dual.
template <class Scalar>
Scalar separation(const ContactPair<Scalar>& pair, const Workspace<Scalar>& ws);

}  // namespace redysim
