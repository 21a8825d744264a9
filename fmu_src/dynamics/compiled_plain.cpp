#include "dynamics/aba.hpp"
#include "dynamics/compiled.hpp"

// Apart from the version for AVX2, beside which it is compiled for less size.

namespace redysim {

void plain_forward_dynamics(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                            const double* qd, const double* inputs, double* qdd) {
  forward_dynamics(plan, ws, q, qd, inputs, qdd);
}

}  // namespace redysim
