#pragma once

#include "integrate/system/system.hpp"

namespace redysim {

// Finds the joint with the largest rate at (time, y), of its own motion or of an actuator state, passes it to
// System::set_failed_joint or set_failed_drive and returns the rate, 1/s. The rate of a joint is the larger
// of sqrt |d qdd / d q| and |d qdd / d qd|, by differences; that of an actuator also the frequency between
// current and speed. 0: none found. For error messages; allocates.
double find_stiffest_joint(System& system, double time, const double* y);

}  // namespace redysim
