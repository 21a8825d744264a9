#pragma once

#include "math/lanes.hpp"
#include "math/vec3.hpp"

// Spatial vectors and inertias, angular part first, at the origin and in the axes of one frame.

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

// Symmetric 3 x 3 matrix.
template <class Scalar>
struct Symmetric3 {
  Scalar xx, yy, zz, xy, xz, yz;

  Vec3<Scalar> operator*(const Vec3<Scalar>& v) const {
    return {xx * v.x() + xy * v.y() + xz * v.z(), xy * v.x() + yy * v.y() + yz * v.z(),
            xz * v.x() + yz * v.y() + zz * v.z()};
  }
};

// Rigid body: mass (kg), first moment h = m c (kg m), inertia about the origin of its frame (kg m^2).
template <class Scalar>
struct RigidInertia {
  Scalar mass = 0;
  Vec3<Scalar> h = Vec3<Scalar>::Zero();
  Symmetric3<Scalar> inertia{Scalar(0), Scalar(0), Scalar(0), Scalar(0), Scalar(0), Scalar(0)};
};

// [moment; force] = [I H; H^T M] [angular; linear], symmetric. The lanes of entry rc are I_rc, M_rc, H_rc,
// H_cr.
template <class Scalar>
struct ArticulatedInertia {
  Lanes<Scalar> xx, yy, zz, xy, xz, yz;
};

// Entry cr from entry rc.
template <class Scalar>
REDYSIM_INLINE Lanes<Scalar> transposed(const Lanes<Scalar>& entry) {
  return permuted<0, 1, 3, 2>(entry);
}

template <class Scalar>
Scalar dot(const Force<Scalar>& f, const Motion<Scalar>& m) {
  return f.moment.dot(m.angular) + f.force.dot(m.linear);
}

// wrench = inertia * motion for a rigid body: M = m 1, H = skew(h).
template <class Scalar>
Force<Scalar> operator*(const RigidInertia<Scalar>& body, const Motion<Scalar>& m) {
  return {body.inertia * m.angular + body.h.cross(m.linear), body.mass * m.linear - body.h.cross(m.angular)};
}

// Component c of a motion, arranged for the product with entry rc. Pairs of lanes of the product sum to
// moment and force.
template <class Scalar>
REDYSIM_INLINE Lanes<Scalar> beside(const Motion<Scalar>& m, int axis) {
  return around(m.angular[axis], m.linear[axis]);
}

template <class Scalar>
REDYSIM_INLINE Force<Scalar> operator*(const ArticulatedInertia<Scalar>& A, const Motion<Scalar>& m) {
  const Lanes<Scalar> mx = beside(m, 0), my = beside(m, 1), mz = beside(m, 2);
  const Lanes<Scalar> x = A.xx * mx + A.xy * my + A.xz * mz;
  const Lanes<Scalar> y = transposed(A.xy) * mx + A.yy * my + A.yz * mz;
  const Lanes<Scalar> z = transposed(A.xz) * mx + transposed(A.yz) * my + A.zz * mz;
  return {{x[0] + x[2], y[0] + y[2], z[0] + z[2]}, {x[1] + x[3], y[1] + y[3], z[1] + z[3]}};
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
void add(RigidInertia<Scalar>& to, const RigidInertia<Scalar>& body) {
  to.mass += body.mass;
  to.h += body.h;
  add(to.inertia, body.inertia);
}

template <class Scalar>
REDYSIM_INLINE void assign(ArticulatedInertia<Scalar>& to, const ArticulatedInertia<Scalar>& A) {
  assign(to.xx, A.xx);
  assign(to.yy, A.yy);
  assign(to.zz, A.zz);
  assign(to.xy, A.xy);
  assign(to.xz, A.xz);
  assign(to.yz, A.yz);
}

template <class Scalar>
REDYSIM_INLINE void add(ArticulatedInertia<Scalar>& to, const ArticulatedInertia<Scalar>& A) {
  to.xx += A.xx;
  to.yy += A.yy;
  to.zz += A.zz;
  to.xy += A.xy;
  to.xz += A.xz;
  to.yz += A.yz;
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

// Adds a symmetric 6 x 6 matrix given by its upper triangle.
template <class Scalar>
void add_upper(ArticulatedInertia<Scalar>& to, const Eigen::Matrix<Scalar, 6, 6>& upper) {
  auto entry = [&upper](int r, int c) {
    return Lanes<Scalar>::of(upper(r, c), upper(3 + r, 3 + c), upper(r, 3 + c), upper(c, 3 + r));
  };
  add(to, {entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)});
}

template <class Scalar>
REDYSIM_INLINE ArticulatedInertia<Scalar> articulated(const RigidInertia<Scalar>& body) {
  const Scalar &m = body.mass, zero(0);
  const Vec3<Scalar>& h = body.h;
  const Symmetric3<Scalar>& I = body.inertia;
  using L = Lanes<Scalar>;
  return {L::of(I.xx, m, zero, zero),       L::of(I.yy, m, zero, zero),
          L::of(I.zz, m, zero, zero),       L::of(I.xy, zero, -h.z(), h.z()),
          L::of(I.xz, zero, h.y(), -h.y()), L::of(I.yz, zero, -h.x(), h.x())};
}

}  // namespace redysim
