#pragma once

#include <array>
#include <cmath>

#include "math/angles.hpp"
#include "math/vec3.hpp"

// A spherical joint inside the recursion: a revolute joint about x at the chart angle beta (0 or 90 deg),
// then revolute joints about z, x, y at the angles (phi, theta, psi), R = Rx(beta) Rz(phi) Rx(theta) Ry(psi)
// (ReDySim's order after the chart). The state is a quaternion and the angular velocity in link axes. The
// chart with the larger cos(theta) is used, which keeps the angles regular; the motion does not depend on the
// chart.

namespace redysim {

template <class Scalar>
struct BallAnglesOf {
  bool turned = false;  // beta = 90 deg
  Scalar phi = 0, theta = 0, psi = 0;
};
using BallAngles = BallAnglesOf<double>;

// Positions of the four joints: beta, phi, theta and psi.
inline std::array<double, 4> joint_positions(const BallAngles& angles) {
  return {angles.turned ? half_pi : 0, angles.phi, angles.theta, angles.psi};
}

// Whether a quaternion of any length has an orientation that can be computed.
inline bool has_orientation(const double* quaternion) {
  const double length = Eigen::Map<const Eigen::Vector4d>(quaternion).norm();
  return length > 1e-6 && length < 1e100;
}

inline Mat3<double> rotation_of(const double* quaternion) {
  return Eigen::Quaterniond(quaternion[0], quaternion[1], quaternion[2], quaternion[3])
      .normalized()
      .toRotationMatrix();
}

// Rx(-90 deg) R
inline Mat3<double> turned_back(const Mat3<double>& R) {
  Mat3<double> turned;
  turned << R.row(0), R.row(2), -R.row(1);
  return turned;
}

inline BallAngles angles_in_chart(const Mat3<double>& rotation, bool turned) {
  const Mat3<double> R = turned ? turned_back(rotation) : rotation;
  return {turned, std::atan2(-R(0, 1), R(1, 1)), std::atan2(R(2, 1), std::hypot(R(0, 1), R(1, 1))),
          std::atan2(-R(2, 0), R(2, 2))};
}

// The angles in the chart with the larger cos(theta).
inline BallAngles ball_angles(const Mat3<double>& rotation) {
  // sin(theta) is R(2,1) in one chart and -R(1,1) in the other
  return angles_in_chart(rotation, std::abs(rotation(2, 1)) > std::abs(rotation(1, 1)));
}

inline Mat3<double> rotation_of(const BallAngles& angles) {
  using Eigen::AngleAxisd;
  const Mat3<double> R =
      (AngleAxisd(angles.phi, Vec3<double>::UnitZ()) * AngleAxisd(angles.theta, Vec3<double>::UnitX()) *
       AngleAxisd(angles.psi, Vec3<double>::UnitY()))
          .toRotationMatrix();
  if (!angles.turned) return R;
  Mat3<double> turned;  // Rx(90 deg) R
  turned << R.row(0), -R.row(2), R.row(1);
  return turned;
}

// E, where E (phi', theta', psi') is the angular velocity in link axes, rad/s.
template <class Scalar>
Mat3<Scalar> rate_matrix(const BallAnglesOf<Scalar>& a) {
  using std::cos;
  using std::sin;
  const Scalar st = sin(a.theta), ct = cos(a.theta), sp = sin(a.psi), cp = cos(a.psi);
  Mat3<Scalar> E;
  E << -sp * ct, cp, Scalar(0), st, Scalar(0), Scalar(1), cp * ct, sp, Scalar(0);
  return E;
}

// E^-1 omega, without a matrix inverse; cos(theta) >= 1/sqrt(2) in the better chart.
template <class Scalar>
Vec3<Scalar> angle_rates(const BallAnglesOf<Scalar>& a, const Vec3<Scalar>& omega) {
  using std::cos;
  using std::sin;
  const Scalar st = sin(a.theta), ct = cos(a.theta), sp = sin(a.psi), cp = cos(a.psi);
  const Scalar phi_rate = (cp * omega.z() - sp * omega.x()) / ct;
  return {phi_rate, cp * omega.x() + sp * omega.z(), omega.y() - st * phi_rate};
}

// E' (phi', theta', psi'): the angular acceleration is E (phi'', theta'', psi'') plus this term.
template <class Scalar>
Vec3<Scalar> rate_bias(const BallAnglesOf<Scalar>& a, const Vec3<Scalar>& rates) {
  using std::cos;
  using std::sin;
  const Scalar st = sin(a.theta), ct = cos(a.theta), sp = sin(a.psi), cp = cos(a.psi);
  const Scalar u = rates.x(), v = rates.y(), w = rates.z();
  return {(st * sp * v - ct * cp * w) * u - sp * w * v, ct * v * u,
          -(ct * sp * w + st * cp * v) * u + cp * w * v};
}

// Rotation vector, in link axes, of a change of a quaternion of any length: vector part of 2 conj(q) dq /
// |q|^2.
inline Vec3<double> rotation_vector(const double* quaternion, const double* change) {
  const Eigen::Map<const Eigen::Vector4d> q(quaternion);
  const Eigen::Map<const Vec3<double>> v(quaternion + 1), dv(change + 1);
  return 2 / q.squaredNorm() * (q[0] * dv - change[0] * v - v.cross(dv));
}

// q' = q (0, omega) / 2 for omega in link axes.
inline void quaternion_rate(const double* q, const double* omega, double* rate) {
  const double w = q[0], x = q[1], y = q[2], z = q[3], a = omega[0], b = omega[1], c = omega[2];
  rate[0] = -0.5 * (x * a + y * b + z * c);
  rate[1] = 0.5 * (w * a + y * c - z * b);
  rate[2] = 0.5 * (w * b + z * a - x * c);
  rate[3] = 0.5 * (w * c + x * b - y * a);
}

}  // namespace redysim
