#pragma once

#include "dynamics/bias.hpp"

// Joint-space inertia matrix by composite bodies (Walker and Orin 1982; Featherstone 2008, Table 6.2).

namespace redysim {

// Inertia of a body after a transformation of its frame: a rotation about an axis, or a shift along it.
template <class Scalar>
class MovedInertia {
 public:
  MovedInertia(RigidInertia<Scalar>& body, int axis)
      : body_(body), axis_(axis), next_((axis + 1) % 3), last_((axis + 2) % 3) {}

  void turn_back_by(const Scalar& cosine, const Scalar& sine) {
    turn_back(body_.h[next_], body_.h[last_], cosine, sine);
    turn_back(off_diagonal(axis_, next_), off_diagonal(axis_, last_), cosine, sine);
    Scalar &first = diagonal(next_), &second = diagonal(last_), &mixed = off_diagonal(next_, last_);
    const Scalar u = sine * (first - second) + cosine * (mixed + mixed), change = sine * u;
    first -= change;
    second += change;
    mixed = cosine * u - mixed;
  }

  void shift_back_by(const Scalar& offset) {
    const Scalar moved = body_.mass * offset, &along = body_.h[axis_];
    const Scalar change = offset * (along + along + moved);
    diagonal(next_) += change;
    diagonal(last_) += change;
    off_diagonal(axis_, next_) -= offset * body_.h[next_];
    off_diagonal(axis_, last_) -= offset * body_.h[last_];
    body_.h[axis_] += moved;
  }

 private:
  Scalar& diagonal(int axis) {
    Symmetric3<Scalar>& I = body_.inertia;
    return axis == 0 ? I.xx : axis == 1 ? I.yy : I.zz;
  }
  Scalar& off_diagonal(int one, int other) {
    Symmetric3<Scalar>& I = body_.inertia;
    const int third = 3 - one - other;
    return third == 0 ? I.yz : third == 1 ? I.xz : I.xy;
  }

  RigidInertia<Scalar>& body_;
  int axis_, next_, last_;
};

// Transforms the inertia of a rigid body from the body's frame to the parent's.
template <class Scalar>
void to_parent(const JointPlan<Scalar>& joint, const JointState<Scalar>& state, RigidInertia<Scalar>& body) {
  MovedInertia<Scalar> x(body, 0), y(body, 1), z(body, 2);
  z.turn_back_by(state.cosine, state.sine);
  if (joint.has_offset) z.shift_back_by(state.offset);
  if (joint.twist == Twist::general) x.turn_back_by(joint.cos_alpha, joint.sin_alpha);
  if (joint.twist == Twist::plus_90) x.turn_back_by(Scalar(0), Scalar(1));
  if (joint.twist == Twist::minus_90) x.turn_back_by(Scalar(0), Scalar(-1));
  x.shift_back_by(joint.a);
  if (!joint.branch) return;
  y.shift_back_by(joint.aside);
  z.turn_back_by(joint.cos_gamma, joint.sin_gamma);
  z.shift_back_by(joint.b);
}

// Joint-space inertia of the open tree, nv x nv (kg m^2, kg m or kg), with armature on the diagonal, both
// triangles. Uses q; overwrites positions. Allocates, so it is not called in steps.
template <class Scalar>
void joint_space_inertia(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q,
                         Eigen::Ref<Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>> M) {
  set_positions(plan, ws, q);
  std::vector<RigidInertia<Scalar>> bodies;  // each body with all outboard ones
  for (const JointPlan<Scalar>& joint : plan.joints) bodies.push_back(joint.inertia);
  M.setZero();
  for (int i = static_cast<int>(plan.joints.size()) - 1; i >= 0; --i) {
    const JointPlan<Scalar>& joint = plan.joints[i];
    // wrench of a unit acceleration of joint i, transmitted to every joint between it and the ground
    Motion<Scalar> unit = Motion<Scalar>::zero();
    add_motion(joint, Scalar(1), unit);
    Force<Scalar> f = bodies[i] * unit;
    M(i, i) = generalized_force(joint, f) + joint.armature;
    for (int j = i; plan.joints[j].parent != ground;) {
      to_parent(plan.joints[j], ws.joints[j], f);
      j = plan.joints[j].parent;
      M(i, j) = M(j, i) = generalized_force(plan.joints[j], f);
    }
    if (joint.parent == ground) continue;
    RigidInertia<Scalar> moved = bodies[i];
    to_parent(joint, ws.joints[i], moved);
    add(bodies[joint.parent], moved);
  }
}

}  // namespace redysim
