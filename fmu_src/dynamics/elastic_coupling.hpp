#pragma once

#include "dynamics/joint_transform.hpp"

// Elastic couplings: the force F(y, y') of dynamics/elastic_force.hpp on y = sum of ratios[k] q[joints[k]] -
// offset acts as -ratios[k] F on each joint.

namespace redysim {

// y at q, or its rate at qd (with offset 0).
template <class Scalar>
Scalar coupling_sum(const CoupledJoints& coupling, const Scalar* q, double offset) {
  Scalar sum(-offset);
  for (std::size_t k = 0; k < coupling.joints.size(); ++k) sum += coupling.ratios[k] * q[coupling.joints[k]];
  return sum;
}

template <class Scalar>
ElasticForce<Scalar> coupling_force(const ElasticCouplingPlan& coupling, const Scalar* q, const Scalar* qd) {
  return {coupling, coupling_sum(coupling, q, coupling.offset), coupling_sum(coupling, qd, 0.0)};
}

// Applies a generalized force f on joint i as a pair of wrenches on its body and the parent.
template <class Scalar>
void add_generalized_force(const Plan<Scalar>& plan, Workspace<Scalar>& ws, int i, const Scalar& f) {
  const JointPlan<Scalar>& joint = plan.joints[i];
  Force<Scalar> pair = Force<Scalar>::zero();
  (turns(joint) ? pair.moment : pair.force).z() = f;
  ws.joints[i].p.moment -= pair.moment;
  ws.joints[i].p.force -= pair.force;
  if (joint.parent == ground) return;
  to_parent(joint, ws.joints[i], pair);
  add(ws.joints[joint.parent].p, pair);
}

// Adds the forces of all elastic couplings. Uses the joint positions in the workspace.
template <class Scalar>
[[gnu::noinline]] void add_coupling_forces(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q,
                                           const Scalar* qd) {
  for (const ElasticCouplingPlan& coupling : plan.elastic_couplings) {
    const Scalar force = coupling_force(coupling, q, qd).sum();
    for (std::size_t k = 0; k < coupling.joints.size(); ++k)
      add_generalized_force(plan, ws, coupling.joints[k], Scalar(-coupling.ratios[k] * force));
  }
}

}  // namespace redysim
