#pragma once

#include "dynamics/bias.hpp"
#include "dynamics/forces_between_bodies.hpp"

namespace redysim {

// Root to leaves: sets ws.joints[i].acceleration to the acceleration of each body (minus gravity) and .p to
// the wrench that accelerates the single body.
template <class Scalar>
void set_body_wrenches(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd,
                       const Scalar* qdd, const Vec3<Scalar>& gravity) {
  set_positions(plan, ws, q);
  set_velocities(plan, ws, qd);
  for (std::size_t i = 0; i < plan.joints.size(); ++i) {
    const JointPlan<Scalar>& joint = plan.joints[i];
    JointState<Scalar>& s = ws.joints[i];
    Motion<Scalar> a{Vec3<Scalar>::Zero(), -gravity};
    if (joint.parent != ground) a = ws.joints[joint.parent].acceleration;
    to_body(joint, s, a);
    a.angular += s.c.angular;
    a.linear += s.c.linear;
    add_motion(joint, qdd[i], a);
    s.acceleration = a;
    // wrench = inertia * acceleration + bias
    s.p = body_bias(joint.inertia, s.omega);
    add(s.p, joint.inertia * a);
  }
}

// Leaves to root: joint forces tau for the wrenches in ws.joints[i].p, which are accumulated towards the
// root.
template <class Scalar>
void collect_joint_forces(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd,
                          const Scalar* qdd, Scalar* tau) {
  for (int i = static_cast<int>(plan.joints.size()) - 1; i >= 0; --i) {
    const JointPlan<Scalar>& joint = plan.joints[i];
    JointState<Scalar>& s = ws.joints[i];
    tau[i] = generalized_force(joint, s.p) + joint.armature * qdd[i] -
             joint_force(plan, i, q[i], qd[i], Scalar(0));
    if (joint.parent == ground) continue;
    Force<Scalar> p = s.p;
    to_parent(joint, s, p);
    add(ws.joints[joint.parent].p, p);
  }
}

// Inverse dynamics of the open tree, recursive Newton-Euler (Luh, Walker, Paul 1980; Fig. 2 of the ReDySim
// paper, left): drive forces tau (nv) for qdd at (q, qd), with gravity, springs, dampers, friction, stops and
// armatures. Uses q, qd, qdd (nv); fills the workspace's accelerations and wrenches.
template <class Scalar>
void inverse_dynamics(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd,
                      const Scalar* qdd, Scalar* tau) {
  set_body_wrenches(plan, ws, q, qd, qdd, plan.gravity);
  add_forces_between_bodies(plan, ws, q, qd);
  collect_joint_forces(plan, ws, q, qd, qdd, tau);
}

}  // namespace redysim
