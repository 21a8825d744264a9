#include "dynamics/aba.hpp"
#include "dynamics/compiled.hpp"
#include "dynamics/rnea.hpp"

// Apart from the versions for AVX2, beside which they are compiled for less size.

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
