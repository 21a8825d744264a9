#include "dynamics/aba.hpp"
#include "dynamics/compiled.hpp"

// In a separate file, since the plain version is optimised for size where an AVX2 version exists.

namespace redysim {

void plain_forward_dynamics(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                            const double* qd, const double* inputs, double* qdd) {
  forward_dynamics(plan, ws, q, qd, inputs, qdd);
}

}  // namespace redysim
