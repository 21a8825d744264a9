#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>

namespace redysim {

// Fixed-size vectors and matrices are Eigen's; the structured spatial types are in spatial.hpp.
template <class Scalar>
using Vec3 = Eigen::Matrix<Scalar, 3, 1>;
template <class Scalar>
using Mat3 = Eigen::Matrix<Scalar, 3, 3>;

// R v, R^T v and A B, written out. In code that is optimised for size, Eigen computes each entry in a
// function call.
template <class Scalar>
Vec3<Scalar> product(const Mat3<Scalar>& R, const Vec3<Scalar>& v) {
  return {R(0, 0) * v[0] + (R(0, 1) * v[1] + R(0, 2) * v[2]),
          R(1, 0) * v[0] + (R(1, 1) * v[1] + R(1, 2) * v[2]),
          R(2, 0) * v[0] + (R(2, 1) * v[1] + R(2, 2) * v[2])};
}
template <class Scalar>
Vec3<Scalar> transposed_product(const Mat3<Scalar>& R, const Vec3<Scalar>& v) {
  return {R(0, 0) * v[0] + (R(1, 0) * v[1] + R(2, 0) * v[2]),
          R(0, 1) * v[0] + (R(1, 1) * v[1] + R(2, 1) * v[2]),
          R(0, 2) * v[0] + (R(1, 2) * v[1] + R(2, 2) * v[2])};
}
template <class Scalar>
Mat3<Scalar> product(const Mat3<Scalar>& A, const Mat3<Scalar>& B) {
  Mat3<Scalar> C;
  for (int k = 0; k < 3; ++k) {
    const Vec3<Scalar> column = product(A, Vec3<Scalar>(B(0, k), B(1, k), B(2, k)));
    for (int i = 0; i < 3; ++i) C(i, k) = column[i];
  }
  return C;
}

// Length of v for directions v / length. The smallest normal number is added under the root, so that the
// direction of a zero vector is zero instead of 0/0.
template <class Scalar>
Scalar safe_norm(const Vec3<Scalar>& v) {
  using std::sqrt;
  return sqrt(v.squaredNorm() + Scalar(std::numeric_limits<double>::min()));
}

}  // namespace redysim
