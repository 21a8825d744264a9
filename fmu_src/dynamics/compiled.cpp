#include "dynamics/compiled.hpp"

#include "dynamics/aba.hpp"
#include "dynamics/clones.hpp"
#include "dynamics/rnea.hpp"

namespace redysim {

namespace {

REDYSIM_AVX2 void forward_with_avx2(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                                    const double* qd, const double* inputs, double* qdd) {
  forward_dynamics(plan, ws, q, qd, inputs, qdd);
}

REDYSIM_AVX2 void inverse_with_avx2(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                                    const double* qd, const double* qdd, double* tau) {
  inverse_dynamics(plan, ws, q, qd, qdd, tau);
}

[[gnu::noinline]] void plain_inverse_dynamics(const Plan<double>& plan, Workspace<double>& ws,
                                              const double* q, const double* qd, const double* qdd,
                                              double* tau) {
  inverse_dynamics(plan, ws, q, qd, qdd, tau);
}

}  // namespace

void compiled_forward_dynamics(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                               const double* qd, const double* inputs, double* qdd) {
  return has_avx2 ? forward_with_avx2(plan, ws, q, qd, inputs, qdd)
                  : plain_forward_dynamics(plan, ws, q, qd, inputs, qdd);
}

void compiled_inverse_dynamics(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                               const double* qd, const double* qdd, double* tau) {
  return has_avx2 ? inverse_with_avx2(plan, ws, q, qd, qdd, tau)
                  : plain_inverse_dynamics(plan, ws, q, qd, qdd, tau);
}

// Inlines all calls; the functions themselves are optimised for size.
[[gnu::flatten]] void compiled_ground_motion(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                                             const double* qd) {
  set_positions(plan, ws, q);
  set_ground_motion(plan, ws, qd);
}

double compiled_prescribed_force(const Plan<double>& plan, const Workspace<double>& ws, int i,
                                 const double* q, const double* qd, const double* qdd) {
  return prescribed_force(plan, ws, i, q, qd, qdd);
}

}  // namespace redysim
