#include "dynamics/compiled.hpp"

#include "dynamics/aba.hpp"
#include "dynamics/rnea.hpp"

#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define REDYSIM_CLONES __attribute__((flatten, target_clones("arch=x86-64-v3", "default")))
#else
#define REDYSIM_CLONES
#endif

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
