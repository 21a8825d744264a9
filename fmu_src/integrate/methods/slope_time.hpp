#pragma once

#include "integrate/system/system.hpp"
#include "model/model.hpp"

namespace redysim {

// CPU time of the steps of a method per right-hand side, over that of `erk`: linear algebra, error test and
// projection included, Jacobians not. An estimate from the size of the system, without a clock, so that the
// same run makes the same choices (docs/solvers.md).
double slope_time(const System& system, SolverMethod method);

}  // namespace redysim
