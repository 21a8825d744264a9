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

// apart: its registers are not saved in calls of the other version
[[gnu::noinline]] void plain_forward(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                                     const double* qd, const double* inputs, double* qdd) {
  forward_dynamics(plan, ws, q, qd, inputs, qdd);
}

}  // namespace

void compiled_forward_dynamics(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                               const double* qd, const double* inputs, double* qdd) {
  return has_avx2 ? forward_with_avx2(plan, ws, q, qd, inputs, qdd)
                  : plain_forward(plan, ws, q, qd, inputs, qdd);
}

void compiled_inverse_dynamics(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                               const double* qd, const double* qdd, double* tau) {
  fastest([&] { inverse_dynamics(plan, ws, q, qd, qdd, tau); });
}

// Without calls, which are copies optimised for size.
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
