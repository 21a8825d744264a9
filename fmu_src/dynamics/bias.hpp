#pragma once

#include "dynamics/ground_motion.hpp"
#include "dynamics/joint_force.hpp"
#include "dynamics/joint_transform.hpp"
#include "math/sin_cos.hpp"

// Root-to-leaves passes at the start of every recursion: joint positions, velocities and velocity products,
// inertias and bias wrenches of the single bodies. Linear accelerations are classical accelerations of the
// body's origin (not spatial), so linear velocities are not needed.

namespace redysim {

// cos, sin and offset of the joints' z screws at q, four joints at a time.
template <class Scalar>
void set_positions(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q) {
  const std::size_t n = plan.joints.size();
  auto angle = [&plan, q, n](std::size_t i) { return i < n ? joint_angle(plan.joints[i], q[i]) : Scalar(0); };
  for (std::size_t i = 0; i < n; i += 4) {
    const SinCos<Scalar> four =
        sin_cos(Lanes<Scalar>::of(angle(i), angle(i + 1), angle(i + 2), angle(i + 3)));
    auto set = [&plan, &ws, &four, q, i, n](int k) {
      const std::size_t j = i + static_cast<std::size_t>(k);
      if (j >= n) return;
      ws.joints[j].cosine = four.cosine[k];
      ws.joints[j].sine = four.sine[k];
      ws.joints[j].offset = joint_offset(plan.joints[j], q[j]);
    };
    set(0);
    set(1);
    set(2);
    set(3);
  }
}

// Sets omega of the body, and c: acceleration of its frame at qdd = 0 and zero acceleration of the parent.
// `w`: angular velocity of the parent, in its axes.
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
    if (joint.aside != Scalar(0)) {
      linear.x() += joint.aside * w.x() * w.y();
      linear.y() -= joint.aside * (w.x() * w.x() + w.z() * w.z());
      linear.z() += joint.aside * w.z() * w.y();
    }
  }
  linear.x() -= joint.a * (w.y() * w.y() + w.z() * w.z());
  linear.y() += joint.a * w.x() * w.y();
  linear.z() += joint.a * w.x() * w.z();
  turn_x_into(joint, w);
  turn_x_into(joint, linear);
  if (joint.has_offset) centripetal_z(s.offset);
  turn_into(w.x(), w.y(), s.cosine, s.sine);
  turn_into(linear.x(), linear.y(), s.cosine, s.sine);
  s.c.linear = linear;
  set_velocity_product(joint, w, qd, s.c);
  if (turns(joint)) w.z() += qd;
  s.omega = w;
}

// The same for a joint on the ground.
template <class Scalar>
void set_root_velocity(const JointPlan<Scalar>& joint, JointState<Scalar>& s, const Scalar& qd) {
  s.c = Motion<Scalar>::zero();
  s.omega = {Scalar(0), Scalar(0), turns(joint) ? qd : Scalar(0)};
}

template <class Scalar>
void set_velocities(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* qd) {
  for (std::size_t i = 0; i < plan.joints.size(); ++i) {
    const JointPlan<Scalar>& joint = plan.joints[i];
    if (joint.parent == ground)
      set_root_velocity(joint, ws.joints[i], qd[i]);
    else
      set_joint_velocity(joint, ws.joints[i], ws.joints[joint.parent].omega, qd[i]);
  }
}

// Sets positions and twists of the bodies, without velocity products, for energy and momentum.
template <class Scalar>
void set_twists(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd) {
  set_positions(plan, ws, q);
  for (std::size_t i = 0; i < plan.joints.size(); ++i) {
    const JointPlan<Scalar>& joint = plan.joints[i];
    Motion<Scalar> twist = Motion<Scalar>::zero();
    if (joint.parent != ground) twist = ws.joints[joint.parent].twist();
    to_body(joint, ws.joints[i], twist);
    add_motion(joint, qd[i], twist);
    ws.joints[i].twist() = twist;
  }
}

// Bias wrench of a single body at zero acceleration: gyroscopic moment and centripetal force.
template <class Scalar>
Force<Scalar> body_bias(const RigidInertia<Scalar>& body, const Vec3<Scalar>& omega) {
  return {omega.cross(body.inertia * omega), omega * omega.dot(body.h) - body.h * omega.squaredNorm()};
}

// Velocities, and inertia and bias wrench of the single bodies. Uses positions.
template <class Scalar>
void set_motion(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* qd) {
  for (std::size_t i = 0; i < plan.joints.size(); ++i) {
    const JointPlan<Scalar>& joint = plan.joints[i];
    JointState<Scalar>& s = ws.joints[i];
    if (joint.parent == ground)
      set_root_velocity(joint, s, qd[i]);
    else
      set_joint_velocity(joint, s, ws.joints[joint.parent].omega, qd[i]);
    assign(s.A, joint.rigid);
    s.p = body_bias(joint.inertia, s.omega);
  }
}

}  // namespace redysim
