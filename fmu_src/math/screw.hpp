#pragma once

#include <utility>

#include "math/spatial.hpp"

// The two elementary displacements of modified DH parameters: a screw about z (angle, offset d) and a screw
// about x (angle, offset a). Only components that change are computed: a rotation preserves the component
// along its axis, and a shift along an axis changes two rows. `into` transforms motions to the displaced
// frame; `back` transforms wrenches and articulated inertias from the displaced frame (Featherstone 2008, 2.8
// and 7.4).

namespace redysim {

// (x, y) -> R(-angle) (x, y): components in the rotated frame.
template <class Scalar>
void turn_into(Scalar& x, Scalar& y, const Scalar& cosine, const Scalar& sine) {
  const Scalar old_x = x;
  x = cosine * old_x + sine * y;
  y = cosine * y - sine * old_x;
}

// (x, y) -> R(angle) (x, y): components in the frame before the rotation.
template <class Value, class Scalar>
REDYSIM_INLINE void turn_back(Value& x, Value& y, const Scalar& cosine, const Scalar& sine) {
  const Value old_x = x;
  x = cosine * old_x - sine * y;
  y = sine * old_x + cosine * y;
}

// E -> R E R^T for the entries in the plane of axes a and b; u is a common term with the double angle.
template <class Scalar>
REDYSIM_INLINE void turn_plane_back(Lanes<Scalar>& aa, Lanes<Scalar>& bb, Lanes<Scalar>& ab,
                                    const Scalar& cosine, const Scalar& sine) {
  const Lanes<Scalar> ba = transposed(ab), u = sine * (aa - bb) + cosine * (ab + ba);
  aa -= sine * u;
  bb += sine * u;
  ab = cosine * u - ba;
}

template <class Scalar>
REDYSIM_INLINE void turn_z_back(ArticulatedInertia<Scalar>& A, const Scalar& cosine, const Scalar& sine) {
  turn_plane_back(A.xx, A.yy, A.xy, cosine, sine);
  turn_back(A.xz, A.yz, cosine, sine);
}

template <class Scalar>
REDYSIM_INLINE void turn_x_back(ArticulatedInertia<Scalar>& A, const Scalar& cosine, const Scalar& sine) {
  turn_plane_back(A.yy, A.zz, A.yz, cosine, sine);
  turn_back(A.xy, A.xz, cosine, sine);
}

// The rotation of an inertia by +90 deg (or -90 deg) about x: a signed permutation.
template <bool negative, class Scalar>
REDYSIM_INLINE void quarter_turn_x_back(ArticulatedInertia<Scalar>& A) {
  std::swap(A.yy, A.zz);
  A.yz = -transposed(A.yz);
  std::swap(A.xy, A.xz);
  if constexpr (negative)
    A.xz = -A.xz;
  else
    A.xy = -A.xy;
}

// Entries perpendicular to r when the reference point moves back by r, |r| = offset:
// H += r~ M, I += r~ H^T + (r~ H^T)^T - r~ M r~.
template <class Scalar>
REDYSIM_INLINE void shift_plane_back(Lanes<Scalar>& aa, Lanes<Scalar>& bb, Lanes<Scalar>& ab,
                                     const Scalar& offset) {
  using L = Lanes<Scalar>;
  const L by = offset * L::of(2, 0, 1, 1), to_I_ab = offset * L::of(1, 0, 1, 0);
  const L to_H_ba = offset * L::of(1, 0, 0, 1), squared = offset * offset * L::of(1, 0, 0, 0);
  const L old_aa = aa, old_ab = ab;
  // I_aa -= 2 r H_ab - r^2 M_bb, H_aa -= r M_ab;  I_bb += 2 r H_ba + r^2 M_aa, H_bb += r M_ab
  aa += squared * permuted<1, 1, 1, 1>(bb) - by * permuted<2, 2, 1, 1>(old_ab);
  // I_ab += r (H_aa - H_bb) - r^2 M_ab, H_ab -= r M_bb, H_ba += r M_aa
  ab += to_H_ba * permuted<2, 2, 2, 1>(old_aa) - to_I_ab * permuted<2, 2, 1, 1>(bb);
  ab -= squared * permuted<1, 1, 1, 1>(old_ab);
  bb += squared * permuted<1, 1, 1, 1>(old_aa) + by * permuted<3, 3, 1, 1>(old_ab);
}

// Moves the reference point back along z by d.
template <class Scalar>
REDYSIM_INLINE void shift_z_back(ArticulatedInertia<Scalar>& A, const Scalar& d) {
  shift_plane_back(A.xx, A.yy, A.xy, d);
  // I_xz -= d H_zy, H_xz -= d M_yz;  I_yz += d H_zx, H_yz += d M_xz
  const Lanes<Scalar> by = d * Lanes<Scalar>::of(1, 0, 1, 0), old_xz = A.xz;
  A.xz -= by * permuted<3, 3, 1, 1>(A.yz);
  A.yz += by * permuted<3, 3, 1, 1>(old_xz);
}

// Moves the reference point back along x by a.
template <class Scalar>
REDYSIM_INLINE void shift_x_back(ArticulatedInertia<Scalar>& A, const Scalar& a) {
  shift_plane_back(A.yy, A.zz, A.yz, a);
  // I_xy -= a H_xz, H_yx -= a M_xz;  I_xz += a H_xy, H_zx += a M_xy
  const Lanes<Scalar> by = a * Lanes<Scalar>::of(1, 0, 0, 1), old_xy = A.xy;
  A.xy -= by * permuted<2, 2, 2, 1>(A.xz);
  A.xz += by * permuted<2, 2, 2, 1>(old_xy);
}

// Moves the reference point back along y by e: T_y(e) = Rx(-90 deg) T_z(e) Rx(90 deg).
template <class Scalar>
REDYSIM_INLINE void shift_y_back(ArticulatedInertia<Scalar>& A, const Scalar& e) {
  quarter_turn_x_back<false>(A);
  shift_z_back(A, e);
  quarter_turn_x_back<true>(A);
}

}  // namespace redysim
