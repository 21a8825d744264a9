#include "dynamics/aba.hpp"
#include "dynamics/compiled.hpp"
#include "dynamics/rnea.hpp"

// In a separate file, since the plain version is optimised for size where an AVX2 version exists.

namespace redysim {

void plain_forward_dynamics(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                            const double* qd, const double* inputs, double* qdd) {
  forward_dynamics(plan, ws, q, qd, inputs, qdd);
}

void plain_inverse_dynamics(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                            const double* qd, const double* qdd, double* tau) {
  inverse_dynamics(plan, ws, q, qd, qdd, tau);
}

}  // namespace redysim
