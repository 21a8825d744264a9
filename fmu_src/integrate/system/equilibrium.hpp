#pragma once

#include "integrate/system/system.hpp"

namespace redysim {

// Result of the search for a rest configuration.
struct Rest {
  enum class End { found, start_moves, motion_moves, none_near } end = End::found;
  int joint = -1;           // of the plan: the one that moves, or that still accelerates most
  double acceleration = 0;  // its qdd, rad/s^2 or m/s^2
};

// Moves the positions of y along the accelerations at rest, with the inputs and parameters of the system, to
// a configuration in which all joints without prescribed motion stay at rest. `y` satisfies the loops; it is
// unchanged if no configuration is found. Pseudo-transient continuation (Kelley and Keyes 1998): implicit
// Euler steps of q' = qdd(q, 0) with exact Jacobians, whose length grows as the accelerations decrease. A
// step that passes an instability is shortened, so that the rest configuration is stable as a rule.
// Allocates.
Rest find_rest(System& system, double time, double* y);

}  // namespace redysim
