#pragma once

#include "integrate/system/system.hpp"

namespace redysim {

// Finds the joint with the largest rate at (time, y), of its own motion or of a state of its actuator, passes
// it to System::set_failed_joint and returns the rate, 1/s: the larger of sqrt |d qdd / d q| and
// |d qdd / d qd|, by differences. 0: none found. For error messages; allocates.
double find_stiffest_joint(System& system, double time, const double* y);

}  // namespace redysim
