#pragma once

#include "math/vec3.hpp"

// Spatial vectors and inertias, angular part first, all at one frame's origin and in its axes.

namespace redysim {

// Twist or spatial acceleration: angular (rad/s, rad/s^2) and linear (m/s, m/s^2) at the origin.
template <class Scalar>
struct Motion {
  Vec3<Scalar> angular, linear;
  static Motion zero() { return {Vec3<Scalar>::Zero(), Vec3<Scalar>::Zero()}; }
};

// Wrench: moment (N m) about the origin and force (N).
template <class Scalar>
struct Force {
  Vec3<Scalar> moment, force;
  static Force zero() { return {Vec3<Scalar>::Zero(), Vec3<Scalar>::Zero()}; }
};

// Symmetric 3x3 matrix by its six entries.
template <class Scalar>
struct Symmetric3 {
  Scalar xx, yy, zz, xy, xz, yz;

  Vec3<Scalar> operator*(const Vec3<Scalar>& v) const {
    return {xx * v.x() + xy * v.y() + xz * v.z(), xy * v.x() + yy * v.y() + yz * v.z(),
            xz * v.x() + yz * v.y() + zz * v.z()};
  }
};

// A rigid body at its frame's origin: mass (kg), first moment h = m c (kg m), inertia about the origin.
template <class Scalar>
struct RigidInertia {
  Scalar mass = 0;
  Vec3<Scalar> h = Vec3<Scalar>::Zero();
  Symmetric3<Scalar> inertia{Scalar(0), Scalar(0), Scalar(0), Scalar(0), Scalar(0), Scalar(0)};
};

// [moment; force] = [I H; H^T M] [angular; linear].
template <class Scalar>
struct ArticulatedInertia {
  Symmetric3<Scalar> I;
  Mat3<Scalar> H;
  Symmetric3<Scalar> M;
};

template <class Scalar>
Scalar dot(const Force<Scalar>& f, const Motion<Scalar>& m) {
  return f.moment.dot(m.angular) + f.force.dot(m.linear);
}

// wrench = inertia * motion for a rigid body: M = m 1, H = skew(h).
template <class Scalar>
Force<Scalar> operator*(const RigidInertia<Scalar>& body, const Motion<Scalar>& m) {
  return {body.inertia * m.angular + body.h.cross(m.linear), body.mass * m.linear - body.h.cross(m.angular)};
}

template <class Scalar>
Force<Scalar> operator*(const ArticulatedInertia<Scalar>& A, const Motion<Scalar>& m) {
  return {A.I * m.angular + A.H * m.linear, A.H.transpose() * m.angular + A.M * m.linear};
}

template <class Scalar>
void add(Symmetric3<Scalar>& to, const Symmetric3<Scalar>& s) {
  to.xx += s.xx;
  to.yy += s.yy;
  to.zz += s.zz;
  to.xy += s.xy;
  to.xz += s.xz;
  to.yz += s.yz;
}

template <class Scalar>
void add(ArticulatedInertia<Scalar>& to, const ArticulatedInertia<Scalar>& A) {
  add(to.I, A.I);
  to.H += A.H;
  add(to.M, A.M);
}

template <class Scalar>
void add(Force<Scalar>& to, const Force<Scalar>& f) {
  to.moment += f.moment;
  to.force += f.force;
}

// Entry 0..5 of [moment; force].
template <class Scalar>
const Scalar& component(const Force<Scalar>& f, int index) {
  return index < 3 ? f.moment[index] : f.force[index - 3];
}

// Adds a symmetric 6x6 matrix given by its upper triangle.
template <class Scalar>
void add_upper(ArticulatedInertia<Scalar>& to, const Eigen::Matrix<Scalar, 6, 6>& upper) {
  add(to.I, {upper(0, 0), upper(1, 1), upper(2, 2), upper(0, 1), upper(0, 2), upper(1, 2)});
  to.H += upper.template topRightCorner<3, 3>();
  add(to.M, {upper(3, 3), upper(4, 4), upper(5, 5), upper(3, 4), upper(3, 5), upper(4, 5)});
}

template <class Scalar>
ArticulatedInertia<Scalar> articulated(const RigidInertia<Scalar>& body) {
  ArticulatedInertia<Scalar> A;
  A.I = body.inertia;
  A.H << Scalar(0), -body.h.z(), body.h.y(), body.h.z(), Scalar(0), -body.h.x(), -body.h.y(), body.h.x(),
      Scalar(0);
  A.M = {body.mass, body.mass, body.mass, Scalar(0), Scalar(0), Scalar(0)};
  return A;
}

}  // namespace redysim
