#pragma once

#include "integrate/system/system.hpp"

namespace redysim {

// Finds the joint whose own motion is the fastest at (time, y), blames it, and returns its rate, 1/s: the
// larger of sqrt |d qdd / d q| and |d qdd / d qd|, by differences. For reports of failure: it allocates. 0:
// nothing was found.
double blame_stiffest_joint(System& system, double time, const double* y);

}  // namespace redysim
