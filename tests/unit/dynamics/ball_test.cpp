#include "dynamics/ball.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace redysim {
namespace {

// Any rotation, and those in which one of the two charts is singular.
std::vector<Mat3<double>> rotations() {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<Mat3<double>> found;
  for (int i = 0; i < 50; ++i)
    found.push_back(Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                        .normalized()
                        .toRotationMatrix());
  for (int axis = 0; axis < 3; ++axis)
    for (double quarters : {0, 1, 2, 3})
      found.push_back(
          Eigen::AngleAxisd(quarters * std::acos(0.0), Vec3<double>::Unit(axis)).toRotationMatrix());
  return found;
}

const Vec3<double> omega(0.7, -1.9, 2.3);

TEST(Ball, angles_give_the_rotation_back_far_from_the_singularity) {
  for (const Mat3<double>& R : rotations()) {
    const BallAngles angles = ball_angles(R);
    EXPECT_LT((rotation_of(angles) - R).norm(), 1e-14);
    EXPECT_GE(std::cos(angles.theta), std::sqrt(0.5) - 1e-14);
  }
}

TEST(Ball, rates_and_angular_velocity_are_inverse) {
  for (const Mat3<double>& R : rotations()) {
    const BallAngles angles = ball_angles(R);
    EXPECT_LT((rate_matrix(angles) * angle_rates(angles, omega) - omega).norm(), 1e-14);
  }
}

// omega = E rates, so at constant rates omega' = E' rates: central differences of E.
TEST(Ball, rate_bias_is_the_derivative_of_the_rate_matrix) {
  const double h = 1e-5;
  for (const Mat3<double>& R : rotations()) {
    const BallAngles angles = ball_angles(R);
    const Vec3<double> rates = angle_rates(angles, omega);
    const auto moved = [&](double time) {
      return BallAngles{angles.turned, angles.phi + time * rates.x(), angles.theta + time * rates.y(),
                        angles.psi + time * rates.z()};
    };
    const Vec3<double> bias = (rate_matrix(moved(h)) - rate_matrix(moved(-h))) * rates / (2 * h);
    EXPECT_LT((rate_bias(angles, rates) - bias).norm(), 1e-7);
  }
}

TEST(Ball, quaternion_turns_with_the_angular_velocity_in_link_axes) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2).normalized();
  const double numbers[] = {q.w(), q.x(), q.y(), q.z()};
  double rate[4];
  quaternion_rate(numbers, omega.data(), rate);
  // exact motion: q(t) = q * exp(omega t / 2)
  const double h = 1e-6;
  const Eigen::Quaterniond later =
      q * Eigen::Quaterniond(Eigen::AngleAxisd(h * omega.norm(), omega.normalized()));
  const double next[] = {later.w(), later.x(), later.y(), later.z()};
  for (int i = 0; i < 4; ++i) EXPECT_NEAR((next[i] - numbers[i]) / h, rate[i], 1e-5);
}

}  // namespace
}  // namespace redysim
