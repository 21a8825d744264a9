#pragma once

#include <cmath>

#include "math/angles.hpp"
#include "math/vec3.hpp"

// Rotation vectors phi = angle * axis of rotations R = exp(phi x), continuous up to an angle of pi.

namespace redysim {

// Unit quaternion (w, v) with w >= 0.
template <class Scalar>
struct HalfTurn {
  Scalar w;
  Vec3<Scalar> v;
};

// Quaternion of R. Starts from its largest component to avoid cancellation.
template <class Scalar>
HalfTurn<Scalar> half_turn(const Mat3<Scalar>& R) {
  using std::sqrt;
  const Scalar trace = R(0, 0) + R(1, 1) + R(2, 2), one(1);
  const Vec3<Scalar> off(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  int largest = 0;
  for (int k = 1; k < 3; ++k)
    if (R(k, k) > R(largest, largest)) largest = k;
  if (trace > R(largest, largest)) {
    const Scalar w = Scalar(0.5) * sqrt(Scalar(one + trace));
    return {w, off / (Scalar(4) * w)};
  }
  const Scalar x = Scalar(0.5) * sqrt(Scalar(one + Scalar(2) * R(largest, largest) - trace));
  HalfTurn<Scalar> q{off[largest] / (Scalar(4) * x), Vec3<Scalar>::Zero()};
  for (int k = 0; k < 3; ++k) q.v[k] = k == largest ? x : (R(largest, k) + R(k, largest)) / (Scalar(4) * x);
  if (q.w < Scalar(0)) return {-q.w, -q.v};
  return q;
}

// phi = scale * v. Also converts the gradient m of an energy by phi to a moment. With phi' = J^-1 omega, the
// power m . phi' is that of the moment
//   m + phi x m / 2 + (1 - angle/2 cot(angle/2)) / angle^2 phi x (phi x m).
template <class Scalar>
class RotationVector {
 public:
  explicit RotationVector(const Mat3<Scalar>& R) {
    using std::atan;
    using std::sqrt;
    const auto [w, v] = half_turn(R);
    v_ = v;
    const Scalar squared = v.squaredNorm();
    if (squared < Scalar(0.01) * w * w) {
      // x = tan(angle/2), atan(x) = x - x^3 rest(x^2)
      const Scalar x2 = squared / (w * w);
      Scalar rest(0);
      for (int k = 8; k >= 0; --k) rest = Scalar(1.0 / (2 * k + 3)) - x2 * rest;
      scale_ = Scalar(2) * (Scalar(1) - x2 * rest) / w;
      second_ = rest / (w * w);
      return;
    }
    const Scalar s = sqrt(squared);
    const Scalar half = w > s ? Scalar(atan(Scalar(s / w))) : Scalar(half_pi - atan(Scalar(w / s)));
    scale_ = Scalar(2) * half / s;
    second_ = (Scalar(1) - w * half / s) / squared;
  }

  Vec3<Scalar> value() const { return v_ * scale_; }

  Vec3<Scalar> moment(const Vec3<Scalar>& gradient) const {
    const Vec3<Scalar> turned = v_.cross(gradient);
    return gradient + turned * (Scalar(0.5) * scale_) + v_.cross(turned) * second_;
  }

 private:
  Vec3<Scalar> v_;
  Scalar scale_, second_;
};

}  // namespace redysim
