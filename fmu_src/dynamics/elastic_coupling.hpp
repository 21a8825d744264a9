#pragma once

#include "dynamics/joint_transform.hpp"
#include "dynamics/smooth_onset.hpp"

// Elastic couplings: a force F(y, y') on y = sum of ratios[k] q[joints[k]] - offset that acts as
// -ratios[k] F on each joint. Without backlash F = k y + c y'. With backlash, at depth x = |y| - backlash /
// 2:
//   F = sign(y) k h(x) + c h'(x) y'        h: dynamics/smooth_onset.hpp; 0 within the backlash

namespace redysim {

// y at q, or its rate at qd (then without the offset).
template <class Scalar>
Scalar coupling_sum(const CoupledJoints& coupling, const Scalar* q, double offset) {
  Scalar sum(-offset);
  for (std::size_t k = 0; k < coupling.joints.size(); ++k) sum += coupling.ratios[k] * q[coupling.joints[k]];
  return sum;
}

// Force, stored energy (J) and dissipation (W, never positive) at (y, y').
template <class Scalar>
struct CouplingForce {
  Scalar force, energy, loss;

  CouplingForce(const ElasticCouplingPlan& law, const Scalar& y, const Scalar& rate) {
    Scalar damping = law.damping * rate;
    if (law.half_play > 0) {
      const bool positive = y > Scalar(0);
      const Scalar depth = (positive ? y : Scalar(-y)) - law.half_play;
      const SmoothOnset<Scalar> onset(depth > Scalar(0) ? depth : Scalar(0), Scalar(law.width));
      damping *= onset.slope();
      force = law.stiffness * onset.force() * (positive ? 1.0 : -1.0);
      energy = law.stiffness * onset.energy();
    } else {
      force = law.stiffness * y;
      energy = 0.5 * law.stiffness * y * y;
    }
    force += damping;
    loss = -(damping * rate);
  }

  static CouplingForce at(const ElasticCouplingPlan& law, const Scalar* q, const Scalar* qd) {
    return {law, coupling_sum(law, q, law.offset), coupling_sum(law, qd, 0.0)};
  }
};

// A generalized force f on joint i as a pair of wrenches on its body and on the parent.
template <class Scalar>
void add_generalized_force(const Plan<Scalar>& plan, Workspace<Scalar>& ws, int i, const Scalar& f) {
  const JointPlan<Scalar>& joint = plan.joints[i];
  Force<Scalar> pair = Force<Scalar>::zero();
  (joint.subspace == Subspace::translation ? pair.force : pair.moment).z() = f;
  ws.joints[i].p.moment -= pair.moment;
  ws.joints[i].p.force -= pair.force;
  if (joint.parent == ground) return;
  to_parent(joint, ws.joints[i], pair);
  add(ws.joints[joint.parent].p, pair);
}

// Uses the joint positions in the workspace.
template <class Scalar>
[[gnu::noinline]] void add_coupling_forces(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q,
                                           const Scalar* qd) {
  for (const ElasticCouplingPlan& coupling : plan.elastic_couplings) {
    const Scalar force = CouplingForce<Scalar>::at(coupling, q, qd).force;
    for (std::size_t k = 0; k < coupling.joints.size(); ++k)
      add_generalized_force(plan, ws, coupling.joints[k], Scalar(-coupling.ratios[k] * force));
  }
}

}  // namespace redysim
