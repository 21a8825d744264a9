#pragma once

#include "dynamics/ground_motion.hpp"
#include "dynamics/joint_transform.hpp"

// Root-to-leaves passes that every recursion starts with: joint positions, velocities and velocity
// products, and the inertia and bias wrench of the single bodies. Accelerations are those of the body's
// origin (not spatial), so linear velocities are never needed.

namespace redysim {

// Torque or force at a joint: actuator, spring and damper.
template <class Scalar>
Scalar joint_force(const JointPlan<Scalar>& joint, const Scalar& q, const Scalar& qd, const Scalar& tau) {
  if (!joint.passive) return tau;
  return tau - joint.stiffness * (q - joint.rest) - joint.damping * qd;
}

template <class Scalar>
void set_positions(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q) {
  for (std::size_t i = 0; i < plan.joints.size(); ++i) set_joint_position(plan.joints[i], q[i], ws.joints[i]);
}

// omega of the body and c: acceleration of its frame when qdd and the parent's acceleration are zero.
template <class Scalar>
void set_joint_velocity(const JointPlan<Scalar>& joint, JointState<Scalar>& s, Vec3<Scalar> w,
                        const Scalar& qd) {
  Vec3<Scalar> linear = Vec3<Scalar>::Zero();
  // omega x (omega x r) for r along z
  auto centripetal_z = [&w, &linear](const Scalar& d) {
    linear.x() += d * w.x() * w.z();
    linear.y() += d * w.y() * w.z();
    linear.z() -= d * (w.x() * w.x() + w.y() * w.y());
  };
  if (joint.branch) {
    centripetal_z(joint.b);
    turn_into(w.x(), w.y(), joint.cos_gamma, joint.sin_gamma);
    turn_into(linear.x(), linear.y(), joint.cos_gamma, joint.sin_gamma);
  }
  linear.x() -= joint.a * (w.y() * w.y() + w.z() * w.z());
  linear.y() += joint.a * w.x() * w.y();
  linear.z() += joint.a * w.x() * w.z();
  turn_x_into(joint, w);
  turn_x_into(joint, linear);
  if (joint.shifted || joint.prismatic) centripetal_z(s.offset);
  turn_into(w.x(), w.y(), s.cosine, s.sine);
  turn_into(linear.x(), linear.y(), s.cosine, s.sine);
  s.c.linear = linear;
  if (joint.prismatic) {
    s.c.linear.x() += Scalar(2) * qd * w.y();
    s.c.linear.y() -= Scalar(2) * qd * w.x();
    s.c.angular.setZero();
  } else {
    s.c.angular = {qd * w.y(), -qd * w.x(), Scalar(0)};
    w.z() += qd;
  }
  s.omega = w;
}

template <class Scalar>
void set_velocities(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* qd) {
  for (std::size_t i = 0; i < plan.joints.size(); ++i) {
    const JointPlan<Scalar>& joint = plan.joints[i];
    Vec3<Scalar> w = Vec3<Scalar>::Zero();
    if (joint.parent != ground) w = ws.joints[joint.parent].omega;
    set_joint_velocity(joint, ws.joints[i], w, qd[i]);
  }
}

// Bias wrench of one free body at acceleration 0: gyroscopic moment and centripetal force.
template <class Scalar>
Force<Scalar> body_bias(const RigidInertia<Scalar>& body, const Vec3<Scalar>& omega) {
  return {omega.cross(body.inertia * omega), omega * omega.dot(body.h) - body.h * omega.squaredNorm()};
}

template <class Scalar>
void set_bias(const Plan<Scalar>& plan, Workspace<Scalar>& ws) {
  for (std::size_t i = 0; i < plan.joints.size(); ++i) {
    const RigidInertia<Scalar>& body = plan.joints[i].inertia;
    ws.joints[i].A = articulated(body);
    ws.joints[i].p = body_bias(body, ws.joints[i].omega);
  }
}

}  // namespace redysim
