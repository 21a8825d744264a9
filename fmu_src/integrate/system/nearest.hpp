#pragma once

#include "integrate/system/system.hpp"

namespace redysim {

// Moves y to the nearest state (mass metric) that satisfies the loop constraints, as System::close_loops, but
// also from states where redundant constraints are inconsistent. False: none found.
bool close_loops_nearest(System& system, double time, double* y);

}  // namespace redysim
