#include "dynamics/compiled.hpp"

#include "dynamics/aba.hpp"
#include "dynamics/clones.hpp"
#include "dynamics/rnea.hpp"

namespace redysim {

REDYSIM_CLONES void compiled_forward_dynamics(const Plan<double>& plan, Workspace<double>& ws,
                                              const double* q, const double* qd, const double* tau,
                                              double* qdd) {
  forward_dynamics(plan, ws, q, qd, tau, qdd);
}

REDYSIM_CLONES void compiled_inverse_dynamics(const Plan<double>& plan, Workspace<double>& ws,
                                              const double* q, const double* qd, const double* qdd,
                                              double* tau) {
  inverse_dynamics(plan, ws, q, qd, qdd, tau);
}

}  // namespace redysim
