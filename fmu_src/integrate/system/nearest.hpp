#pragma once

#include "integrate/system/system.hpp"

namespace redysim {

// Moves y to the nearest state (mass metric) that satisfies the loop constraints, as System::close_loops,
// also from places where redundant constraints contradict each other. False: it was not found.
bool close_loops_nearest(System& system, double time, double* y);

}  // namespace redysim
