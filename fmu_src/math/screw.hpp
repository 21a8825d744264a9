#pragma once

#include <utility>

#include "math/spatial.hpp"

// The two elementary displacements of modified DH: a screw about z (angle, offset d) and a screw about x
// (angle, offset a). Each changes only what it must: an axis' own component stays, and a shift along an
// axis touches two rows. Forward maps a motion into the displaced frame; back maps a wrench or an
// articulated inertia from the displaced frame to the frame before (Featherstone 2008, 2.8 and 7.4).

namespace redysim {

// (x, y) -> R(-angle) (x, y): components in the frame turned by the angle.
template <class Scalar>
void turn_into(Scalar& x, Scalar& y, const Scalar& cosine, const Scalar& sine) {
  const Scalar old_x = x;
  x = cosine * old_x + sine * y;
  y = cosine * y - sine * old_x;
}

// (x, y) -> R(angle) (x, y): components in the frame before the turn.
template <class Scalar>
void turn_back(Scalar& x, Scalar& y, const Scalar& cosine, const Scalar& sine) {
  const Scalar old_x = x;
  x = cosine * old_x - sine * y;
  y = sine * old_x + cosine * y;
}

// The 2x2 block of S -> R S R^T; one product u serves the double angle.
template <class Scalar>
void turn_plane_back(Scalar& aa, Scalar& bb, Scalar& ab, const Scalar& cosine, const Scalar& sine) {
  const Scalar u = sine * (aa - bb) + Scalar(2) * cosine * ab;
  aa -= sine * u;
  bb += sine * u;
  ab = cosine * u - ab;
}

// The same with the coupling to the axis of the turn.
template <class Scalar>
void turn_symmetric_back(Scalar& aa, Scalar& bb, Scalar& ab, Scalar& ac, Scalar& bc, const Scalar& cosine,
                         const Scalar& sine) {
  turn_plane_back(aa, bb, ab, cosine, sine);
  turn_back(ac, bc, cosine, sine);
}

// The 2x2 block of H -> R H R^T.
template <class Scalar>
void turn_block_back(Scalar& aa, Scalar& bb, Scalar& ab, Scalar& ba, const Scalar& cosine,
                     const Scalar& sine) {
  const Scalar u = sine * (aa - bb) + cosine * (ab + ba), old_ab = ab;
  aa -= sine * u;
  bb += sine * u;
  ab = cosine * u - ba;
  ba = cosine * u - old_ab;
}

// H -> R H R^T for a turn in the plane of axes a, b; c is the axis of the turn.
template <int a, int b, int c, class Scalar>
void turn_general_back(Mat3<Scalar>& H, const Scalar& cosine, const Scalar& sine) {
  turn_block_back(H(a, a), H(b, b), H(a, b), H(b, a), cosine, sine);
  turn_back(H(a, c), H(b, c), cosine, sine);
  turn_back(H(c, a), H(c, b), cosine, sine);
}

// `free` axis: no moment about z (row z of I and H is zero), as behind an eliminated revolute joint.
template <bool free, class Scalar>
void turn_z_back(ArticulatedInertia<Scalar>& A, const Scalar& cosine, const Scalar& sine) {
  if constexpr (free) {
    turn_plane_back(A.I.xx, A.I.yy, A.I.xy, cosine, sine);
    turn_block_back(A.H(0, 0), A.H(1, 1), A.H(0, 1), A.H(1, 0), cosine, sine);
    turn_back(A.H(0, 2), A.H(1, 2), cosine, sine);
  } else {
    turn_symmetric_back(A.I.xx, A.I.yy, A.I.xy, A.I.xz, A.I.yz, cosine, sine);
    turn_general_back<0, 1, 2>(A.H, cosine, sine);
  }
  turn_symmetric_back(A.M.xx, A.M.yy, A.M.xy, A.M.xz, A.M.yz, cosine, sine);
}

template <class Scalar>
void turn_x_back(ArticulatedInertia<Scalar>& A, const Scalar& cosine, const Scalar& sine) {
  turn_symmetric_back(A.I.yy, A.I.zz, A.I.yz, A.I.xy, A.I.xz, cosine, sine);
  turn_general_back<1, 2, 0>(A.H, cosine, sine);
  turn_symmetric_back(A.M.yy, A.M.zz, A.M.yz, A.M.xy, A.M.xz, cosine, sine);
}

// The same for +90 deg (or -90 deg) about x: a signed permutation.
template <class Scalar>
void quarter_turn_x_back(ArticulatedInertia<Scalar>& A, bool negative) {
  auto turn_pair = [negative](Scalar& y, Scalar& z) {
    const Scalar old_y = y;
    y = negative ? z : Scalar(-z);
    z = negative ? Scalar(-old_y) : old_y;
  };
  auto turn_symmetric = [&turn_pair](Symmetric3<Scalar>& S) {
    std::swap(S.yy, S.zz);
    S.yz = -S.yz;
    turn_pair(S.xy, S.xz);
  };
  turn_symmetric(A.I);
  turn_symmetric(A.M);
  std::swap(A.H(1, 1), A.H(2, 2));
  const Scalar old_yz = A.H(1, 2);
  A.H(1, 2) = -A.H(2, 1);
  A.H(2, 1) = -old_yz;
  turn_pair(A.H(1, 0), A.H(2, 0));
  turn_pair(A.H(0, 1), A.H(0, 2));
}

// Moves the reference point back along z by d: H += r~ M, I += r~ H^T + (r~ H^T)^T - r~ M r~, r = d z.
template <bool free, class Scalar>
void shift_z_back(ArticulatedInertia<Scalar>& A, const Scalar& d) {
  const Scalar m_xy = d * A.M.xy, m_xx = d * A.M.xx, m_yy = d * A.M.yy;
  A.I.xx += d * (m_yy - Scalar(2) * A.H(0, 1));
  A.I.yy += d * (m_xx + Scalar(2) * A.H(1, 0));
  A.I.xy += d * (A.H(0, 0) - A.H(1, 1) - m_xy);
  if constexpr (!free) {
    A.I.xz -= d * A.H(2, 1);
    A.I.yz += d * A.H(2, 0);
  }
  A.H(0, 0) -= m_xy;
  A.H(0, 1) -= m_yy;
  A.H(0, 2) -= d * A.M.yz;
  A.H(1, 0) += m_xx;
  A.H(1, 1) += m_xy;
  A.H(1, 2) += d * A.M.xz;
}

// The same along x by a: r = a x.
template <class Scalar>
void shift_x_back(ArticulatedInertia<Scalar>& A, const Scalar& a) {
  const Scalar m_yz = a * A.M.yz, m_yy = a * A.M.yy, m_zz = a * A.M.zz;
  A.I.yy += a * (m_zz - Scalar(2) * A.H(1, 2));
  A.I.zz += a * (m_yy + Scalar(2) * A.H(2, 1));
  A.I.yz += a * (A.H(1, 1) - A.H(2, 2) - m_yz);
  A.I.xy -= a * A.H(0, 2);
  A.I.xz += a * A.H(0, 1);
  A.H(1, 1) -= m_yz;
  A.H(1, 2) -= m_zz;
  A.H(1, 0) -= a * A.M.xz;
  A.H(2, 2) += m_yz;
  A.H(2, 1) += m_yy;
  A.H(2, 0) += a * A.M.xy;
}

}  // namespace redysim
