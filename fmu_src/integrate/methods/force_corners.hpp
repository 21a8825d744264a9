#pragma once

#include <cstdint>

#include "integrate/system/system.hpp"

// Where forces change within one or two steps of order 5: at stops, reversals against dry friction, backlash,
// limits of actuators and contacts. An error estimate of order 8 does not see all of such a corner within its
// step.

namespace redysim {

bool has_backlash(const System& system);
bool has_corners(const System& system);

// Until a joint comes to a corner of its force by stops or friction, s, with constant accelerations;
// infinity: never. `slope`: of the state y.
double time_to_corner(const System& system, const double* y, const double* slope);

// Numbers of the regions between the corners in which a state lies, and in which the contacts and limits of
// actuators were in the last right-hand side, that at y.
std::uint64_t regions_of_state(System& system, double time, const double* y);
std::uint64_t regions_of_evaluation(System& system, double time, const double* y);

}  // namespace redysim
