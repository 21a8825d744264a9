#include "model/dh.hpp"

#include <cmath>

#include "math/angles.hpp"

namespace redysim {

Pose operator*(const Pose& first, const Pose& second) {
  return {first.rotation * second.rotation, first.rotation * second.position + first.position};
}

Pose inverse(const Pose& pose) {
  return {pose.rotation.transpose(), -(pose.rotation.transpose() * pose.position)};
}

Turn turn_of(double angle) {
  constexpr double rounding = 1e-15;
  const Turn turn{std::cos(angle), std::sin(angle)};
  if (std::abs(turn.sine) < rounding) return {turn.cosine > 0 ? 1.0 : -1.0, 0};
  if (std::abs(turn.cosine) < rounding) return {0, turn.sine > 0 ? 1.0 : -1.0};
  return turn;
}

namespace {

Pose screw_z(double angle, double offset) {
  const auto [c, s] = turn_of(angle);
  Pose pose;
  pose.rotation << c, -s, 0, s, c, 0, 0, 0, 1;
  pose.position.z() = offset;
  return pose;
}

Pose screw_x(double angle, double offset) {
  const auto [c, s] = turn_of(angle);
  Pose pose;
  pose.rotation << 1, 0, 0, 0, c, -s, 0, s, c;
  pose.position.x() = offset;
  return pose;
}

}  // namespace

Pose pose_of(const DhParameters& dh) {
  return screw_z(dh.gamma, dh.b) * screw_x(dh.alpha, dh.a) * screw_z(dh.theta, dh.d);
}

DhParameters dh_of(const Pose& pose) {
  // R = Rz(gamma) Rx(alpha) Rz(theta), p = Rz(gamma) (a, -d sin(alpha), b + d cos(alpha))
  const Mat3<double>& R = pose.rotation;
  const Vec3<double>& p = pose.position;
  DhParameters dh;
  const double sine = std::hypot(R(0, 2), R(1, 2));
  dh.alpha = std::atan2(sine, R(2, 2));
  if (sine > 1e-12) {
    dh.gamma = std::atan2(R(0, 2), -R(1, 2));
    // remainder after Rx(-alpha) Rz(-gamma); it includes the rounding error of gamma
    const Mat3<double> rest = (screw_z(dh.gamma, 0) * screw_x(dh.alpha, 0)).rotation.transpose() * R;
    dh.theta = std::atan2(rest(1, 0), rest(0, 0));
    dh.a = std::cos(dh.gamma) * p.x() + std::sin(dh.gamma) * p.y();
    dh.d = (std::sin(dh.gamma) * p.x() - std::cos(dh.gamma) * p.y()) / sine;
  } else {
    // parallel axes: the common normal passes through the child's origin
    dh.alpha = R(2, 2) > 0 ? 0.0 : pi;
    dh.a = std::hypot(p.x(), p.y());
    dh.gamma = dh.a > 0 ? std::atan2(p.y(), p.x()) : 0.0;
    const double turn = std::atan2(R(1, 0), R(0, 0));
    dh.theta = R(2, 2) > 0 ? turn - dh.gamma : dh.gamma - turn;
  }
  dh.b = p.z() - dh.d * std::cos(dh.alpha);
  return dh;
}

}  // namespace redysim
