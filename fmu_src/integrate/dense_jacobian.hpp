#pragma once

#include <vector>

#include "integrate/system.hpp"

namespace redysim {

// d(ydot)/dy at (time, y), columns of length System::size() one after the other in `jacobian`;
// `slope` = f(time, y), `room` as long as a column. Difference quotients: a right-hand side a column,
// added to `evaluations`; the work is no argument of the right-hand side.
Status dense_jacobian(System& system, double time, const double* y, const double* slope, double* jacobian,
                      std::vector<double>& room, long& evaluations);

}  // namespace redysim
