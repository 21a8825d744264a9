#pragma once

#include <algorithm>
#include <cmath>

#include "dynamics/elastic_coupling.hpp"
#include "dynamics/loops/loop_rows.hpp"

// Rows of rigid couplings, phi = sum of ratios[k] q[joints[k]] - offset. They are linear in q: the levers are
// the ratios, and phi'' has no part quadratic in velocities.

namespace redysim {

// Sets wrenches and b of the rows at the start of an elimination. b contains the accelerations of prescribed
// joints.
template <class Scalar>
[[gnu::noinline]] void set_coupling_rows(const Plan<Scalar>& plan, Workspace<Scalar>& ws,
                                         const Scalar* inputs) {
  LoopState<Scalar>& state = ws.loop;
  for (const CouplingPlan& coupling : plan.couplings) {
    const std::size_t row = static_cast<std::size_t>(coupling.row);
    state.wrench[0][row] = state.wrench[1][row] = state.K[row] = Force<Scalar>::zero();
    state.squared_moment_rounding[row] = Scalar(0);
    state.b[row] = Scalar(0);
    for (std::size_t k = 0; k < coupling.joints.size(); ++k)
      if (plan.joints[coupling.joints[k]].prescribed)
        state.b[row] -= coupling.ratios[k] * inputs[coupling.joints[k]];
  }
}

// Sets the residuals of the rows at q, and the magnitudes of their terms.
template <class Scalar>
[[gnu::noinline]] void set_coupling_residuals(const Plan<Scalar>& plan, LoopState<Scalar>& state,
                                              const Scalar* q) {
  for (const CouplingPlan& coupling : plan.couplings) {
    state.residual[coupling.row] = coupling_sum(coupling, q, coupling.offset);
    double size = 0;
    for (std::size_t k = 0; k < coupling.joints.size(); ++k) {
      const int joint = coupling.joints[k];
      size = std::max(size, std::abs(coupling.ratios[k]) *
                                std::max(std::abs(value_of(q[joint])), plan.joint_units[joint]));
    }
    state.residual_size[coupling.row] = size;
  }
}

// Sets the rates of the rows at qd, and the magnitudes of their terms at the maximum speed of the cluster,
// since the coupled joints may be at rest.
template <class Scalar>
[[gnu::noinline]] void set_coupling_rates(const Plan<Scalar>& plan, LoopState<Scalar>& state,
                                          const Scalar* qd) {
  for (const ClusterPlan& cluster : plan.clusters) {
    if (cluster.coupling_count == 0) continue;
    double speed = 0;  // units per s
    for (int joint : cluster.joints)
      speed = std::max(speed, std::abs(value_of(qd[joint])) / plan.joint_units[joint]);
    for (int k = cluster.first_coupling; k < cluster.first_coupling + cluster.coupling_count; ++k) {
      const CouplingPlan& coupling = plan.couplings[k];
      state.rate[coupling.row] = coupling_sum(coupling, qd, 0.0);
      double size = 0;
      for (std::size_t n = 0; n < coupling.joints.size(); ++n)
        size = std::max(size, std::abs(coupling.ratios[n]) * plan.joint_units[coupling.joints[n]]);
      state.rate_size[coupling.row] = size * speed;
    }
  }
}

// Sets residuals and rates of all loops and rigid couplings, after a correction of q or qd. `with_sizes`:
// also the magnitudes of the loops' terms, which small corrections do not change. Does not change the
// elimination in the workspace. Uses ws.ground.
template <class Scalar>
void set_constraint_residuals(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q,
                              const Scalar* qd, bool with_sizes = true) {
  set_loop_residuals(plan, ws, with_sizes);
  if (plan.couplings.empty()) return;
  set_coupling_residuals(plan, ws.loop, q);
  set_coupling_rates(plan, ws.loop, qd);
}

}  // namespace redysim
