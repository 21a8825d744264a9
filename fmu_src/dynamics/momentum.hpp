#pragma once

#include "dynamics/bias.hpp"

namespace redysim {

// Linear momentum (kg m/s) and angular momentum about the ground's origin (kg m^2/s) of all bodies, ground
// axes: force and moment of a Force stand for them. Uses q, qd (plan.nv); overwrites positions, p and c.
template <class Scalar>
Force<Scalar> momentum(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd) {
  set_positions(plan, ws, q);
  for (std::size_t i = 0; i < plan.joints.size(); ++i) {
    const JointPlan<Scalar>& joint = plan.joints[i];
    Motion<Scalar> twist = Motion<Scalar>::zero();
    if (joint.parent != ground) twist = ws.joints[joint.parent].acceleration;
    to_body(joint, ws.joints[i], twist);
    add_motion(joint, qd[i], twist);
    ws.joints[i].acceleration = twist;  // the pass keeps twists where accelerations stand
    ws.joints[i].p = joint.inertia * twist;
  }
  Force<Scalar> total = Force<Scalar>::zero();
  for (std::size_t i = plan.joints.size(); i-- > 0;) {
    Force<Scalar> h = ws.joints[i].p;
    to_parent(plan.joints[i], ws.joints[i], h);
    const int parent = plan.joints[i].parent;
    add(parent == ground ? total : ws.joints[parent].p, h);
  }
  return total;
}

}  // namespace redysim
