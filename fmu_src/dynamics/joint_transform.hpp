#pragma once

#include <cmath>

#include "dynamics/motion_subspace.hpp"
#include "math/screw.hpp"

// Motions, wrenches and articulated inertias across one joint: up to three elementary screws (branch, x,
// z), each omitted if it is the identity. In DeNOC terms: A_ij and its transpose.

namespace redysim {

template <class Scalar>
void turn_x_into(const JointPlan<Scalar>& joint, Vec3<Scalar>& v) {
  const Scalar y = v.y();
  switch (joint.twist) {
    case Twist::none:
      return;
    case Twist::plus_90:
      v.y() = v.z();
      v.z() = -y;
      return;
    case Twist::minus_90:
      v.y() = -v.z();
      v.z() = y;
      return;
    case Twist::general:
      turn_into(v.y(), v.z(), joint.cos_alpha, joint.sin_alpha);
      return;
  }
}

template <class Scalar>
void turn_x_back(const JointPlan<Scalar>& joint, Vec3<Scalar>& v) {
  const Scalar y = v.y();
  switch (joint.twist) {
    case Twist::none:
      return;
    case Twist::plus_90:
      v.y() = -v.z();
      v.z() = y;
      return;
    case Twist::minus_90:
      v.y() = v.z();
      v.z() = -y;
      return;
    case Twist::general:
      turn_back(v.y(), v.z(), joint.cos_alpha, joint.sin_alpha);
      return;
  }
}

template <class Scalar>
void turn_x_back(const JointPlan<Scalar>& joint, ArticulatedInertia<Scalar>& A) {
  switch (joint.twist) {
    case Twist::none:
      return;
    case Twist::plus_90:
      quarter_turn_x_back<false>(A);
      return;
    case Twist::minus_90:
      quarter_turn_x_back<true>(A);
      return;
    case Twist::general:
      turn_x_back(A, joint.cos_alpha, joint.sin_alpha);
      return;
  }
}

// Sets cos, sin and offset of one joint's z screw at q.
template <class Scalar>
void set_joint_position(const JointPlan<Scalar>& joint, const Scalar& q, JointState<Scalar>& state) {
  using std::cos;
  using std::sin;
  state.cosine = cos(joint_angle(joint, q));
  state.sine = sin(joint_angle(joint, q));
  state.offset = joint_offset(joint, q);
}

// Rotates a motion from the parent's axes to the body's axes, at the same point.
template <class Scalar>
void turn_to_body(const JointPlan<Scalar>& joint, const JointState<Scalar>& state, Motion<Scalar>& m) {
  for (Vec3<Scalar>* v : {&m.angular, &m.linear}) {
    if (joint.branch) turn_into(v->x(), v->y(), joint.cos_gamma, joint.sin_gamma);
    turn_x_into(joint, *v);
    turn_into(v->x(), v->y(), state.cosine, state.sine);
  }
}

// Transforms a motion from the parent's frame to the body's frame (joint at rest).
template <class Scalar>
void to_body(const JointPlan<Scalar>& joint, const JointState<Scalar>& state, Motion<Scalar>& m) {
  auto shift_z = [&m](const Scalar& d) {
    m.linear.x() += d * m.angular.y();
    m.linear.y() -= d * m.angular.x();
  };
  if (joint.branch) {
    shift_z(joint.b);
    turn_into(m.angular.x(), m.angular.y(), joint.cos_gamma, joint.sin_gamma);
    turn_into(m.linear.x(), m.linear.y(), joint.cos_gamma, joint.sin_gamma);
    if (joint.aside != Scalar(0)) {
      m.linear.x() -= joint.aside * m.angular.z();
      m.linear.z() += joint.aside * m.angular.x();
    }
  }
  m.linear.y() += joint.a * m.angular.z();
  m.linear.z() -= joint.a * m.angular.y();
  turn_x_into(joint, m.angular);
  turn_x_into(joint, m.linear);
  if (joint.has_offset) shift_z(state.offset);
  turn_into(m.angular.x(), m.angular.y(), state.cosine, state.sine);
  turn_into(m.linear.x(), m.linear.y(), state.cosine, state.sine);
}

// Transforms a wrench from the body's frame to the parent's frame.
template <class Scalar>
void to_parent(const JointPlan<Scalar>& joint, const JointState<Scalar>& state, Force<Scalar>& f) {
  auto shift_z = [&f](const Scalar& d) {
    f.moment.x() -= d * f.force.y();
    f.moment.y() += d * f.force.x();
  };
  turn_back(f.moment.x(), f.moment.y(), state.cosine, state.sine);
  turn_back(f.force.x(), f.force.y(), state.cosine, state.sine);
  if (joint.has_offset) shift_z(state.offset);
  turn_x_back(joint, f.moment);
  turn_x_back(joint, f.force);
  f.moment.y() -= joint.a * f.force.z();
  f.moment.z() += joint.a * f.force.y();
  if (joint.branch) {
    if (joint.aside != Scalar(0)) {
      f.moment.x() += joint.aside * f.force.z();
      f.moment.z() -= joint.aside * f.force.x();
    }
    turn_back(f.moment.x(), f.moment.y(), joint.cos_gamma, joint.sin_gamma);
    turn_back(f.force.x(), f.force.y(), joint.cos_gamma, joint.sin_gamma);
    shift_z(joint.b);
  }
}

// Transforms an articulated inertia from the body's frame to the parent's frame.
template <class Scalar>
void to_parent(const JointPlan<Scalar>& joint, const JointState<Scalar>& state,
               ArticulatedInertia<Scalar>& A) {
  turn_z_back(A, state.cosine, state.sine);
  if (joint.has_offset) shift_z_back(A, state.offset);
  turn_x_back(joint, A);
  if (joint.a != Scalar(0)) shift_x_back(A, joint.a);
  if (joint.branch) {
    if (joint.aside != Scalar(0)) shift_y_back(A, joint.aside);
    turn_z_back(A, joint.cos_gamma, joint.sin_gamma);
    shift_z_back(A, joint.b);
  }
}

// Position of the body's origin in the parent's axes and rotation parent <- body.
template <class Scalar>
void joint_pose(const JointPlan<Scalar>& joint, const JointState<Scalar>& state, Mat3<Scalar>& rotation,
                Vec3<Scalar>& position) {
  const Scalar &c = state.cosine, &s = state.sine, zero(0), one(1);
  Vec3<Scalar> x(c, s, zero), y(-s, c, zero), z(zero, zero, one);
  switch (joint.twist) {
    case Twist::none:
      break;
    case Twist::plus_90:
      x = {c, zero, s};
      y = {-s, zero, c};
      z = {zero, -one, zero};
      break;
    case Twist::minus_90:
      x = {c, zero, -s};
      y = {-s, zero, -c};
      z = {zero, one, zero};
      break;
    case Twist::general:
      x = {c, joint.cos_alpha * s, joint.sin_alpha * s};
      y = {-s, joint.cos_alpha * c, joint.sin_alpha * c};
      z = {zero, -joint.sin_alpha, joint.cos_alpha};
      break;
  }
  position = {joint.a, z.y() * state.offset, z.z() * state.offset};
  if (joint.branch) {
    for (Vec3<Scalar>* axis : {&x, &y, &z}) turn_back(axis->x(), axis->y(), joint.cos_gamma, joint.sin_gamma);
    position.y() += joint.aside;
    turn_back(position.x(), position.y(), joint.cos_gamma, joint.sin_gamma);
    position.z() += joint.b;
  }
  rotation.col(0) = x;
  rotation.col(1) = y;
  rotation.col(2) = z;
}

}  // namespace redysim
