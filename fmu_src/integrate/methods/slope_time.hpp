#pragma once

#include "integrate/system/system.hpp"
#include "model/model.hpp"

namespace redysim {

// CPU time per right-hand side of a method, relative to that of `erk`. It includes linear algebra, error test
// and projection, but no Jacobians. It is estimated from the size of the system, not measured, so that equal
// runs make equal choices (docs/solver_measurements.md).
double slope_time(const System& system, SolverMethod method);

}  // namespace redysim
