#pragma once

#include "integrate/system/system.hpp"

namespace redysim {

// Result of the search for a rest configuration.
struct Rest {
  enum class End { found, start_moves, motion_moves, none_near } end = End::found;
  int joint = -1;           // index into the plan: a joint that moves, or the one that accelerates most
  double acceleration = 0;  // its qdd, rad/s^2 or m/s^2
};

// Moves the positions of y along the accelerations at rest to a configuration in which all joints without
// prescribed motion stay at rest, with the inputs and parameters of the system. `y` must satisfy the loop
// constraints; it is unchanged if no configuration is found. Pseudo-transient continuation (Kelley and Keyes
// 1998): implicit Euler steps of q' = qdd(q, 0) with exact Jacobians, whose length grows as the accelerations
// decrease. A step that passes an instability is shortened, so the rest configuration is usually stable.
// `scales`: of the changes of the joints with one degree of freedom (search_scale). Allocates.
Rest find_rest(System& system, const std::vector<double>& scales, double time, double* y);

}  // namespace redysim
