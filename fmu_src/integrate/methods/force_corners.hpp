#pragma once

#include "integrate/system/system.hpp"

// Where forces change within one or two steps of order 5: at stops, reversals against dry friction, and
// backlash. An error estimate of order 8 does not see all of such a corner within its step.

namespace redysim {

bool has_backlash(const System& system);
bool has_corners(const System& system);

// Until a joint comes to a corner of its force by stops or friction, s, with constant accelerations;
// infinity: never. `slope`: of the state y.
double time_to_corner(const System& system, const double* y, const double* slope);

// Whether one lies between two states.
bool crosses_corner(const System& system, const double* before, const double* after);

}  // namespace redysim
