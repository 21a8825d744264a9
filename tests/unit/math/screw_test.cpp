#include "math/screw.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "support/random_tree.hpp"

// Each screw against the dense product X^T A X.

namespace redysim {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

Mat3<double> skew(const Vec3<double>& v) {
  Mat3<double> m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// Lanes of an entry: I_rc, M_rc, H_rc, H_cr.
Matrix6 dense(const ArticulatedInertia<double>& A) {
  Matrix6 m;
  auto set = [&m](int r, int c, const Lanes<double>& entry) {
    m(r, c) = m(c, r) = entry[0];
    m(3 + r, 3 + c) = m(3 + c, 3 + r) = entry[1];
    m(r, 3 + c) = m(3 + c, r) = entry[2];
    m(c, 3 + r) = m(3 + r, c) = entry[3];
  };
  set(0, 0, A.xx);
  set(1, 1, A.yy);
  set(2, 2, A.zz);
  set(0, 1, A.xy);
  set(0, 2, A.xz);
  set(1, 2, A.yz);
  return m;
}

// Motion of the frame before -> of a frame turned by R and then moved to r.
Matrix6 motion_transform(const Mat3<double>& R, const Vec3<double>& r) {
  Matrix6 X;
  X << R.transpose(), Mat3<double>::Zero(), -R.transpose() * skew(r), R.transpose();
  return X;
}

ArticulatedInertia<double> random_inertia(test::Random& random) {
  Matrix6 B;
  for (double& entry : B.reshaped()) entry = random.between(-1, 1);
  ArticulatedInertia<double> A = articulated(RigidInertia<double>());
  add_upper(A, Matrix6(B * B.transpose()));
  return A;
}

class Screws : public testing::TestWithParam<unsigned> {
 protected:
  test::Random random{GetParam()};
  double angle = random.between(-3, 3), offset = random.between(-1, 1);
  Mat3<double> about(const Vec3<double>& axis) const {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  }
};
INSTANTIATE_TEST_SUITE_P(Seed, Screws, testing::Range(0u, 10u));

void expect_equal(const ArticulatedInertia<double>& found, const ArticulatedInertia<double>& before,
                  const Matrix6& X) {
  EXPECT_LT((dense(found) - X.transpose() * dense(before) * X).lpNorm<Eigen::Infinity>(), 1e-14);
}

TEST_P(Screws, turn_about_z_is_the_dense_product) {
  const Matrix6 X = motion_transform(about(Vec3<double>::UnitZ()), Vec3<double>::Zero());
  auto A = random_inertia(random), before = A;
  turn_z_back(A, std::cos(angle), std::sin(angle));
  expect_equal(A, before, X);
}

TEST_P(Screws, turn_about_x_is_the_dense_product) {
  auto A = random_inertia(random), before = A;
  turn_x_back(A, std::cos(angle), std::sin(angle));
  expect_equal(A, before, motion_transform(about(Vec3<double>::UnitX()), Vec3<double>::Zero()));
}

TEST_P(Screws, quarter_turn_about_x_is_the_general_turn) {
  for (const double sign : {1.0, -1.0}) {
    auto A = random_inertia(random), before = A;
    sign < 0 ? quarter_turn_x_back<true>(A) : quarter_turn_x_back<false>(A);
    angle = sign * 1.5707963267948966;
    expect_equal(A, before, motion_transform(about(Vec3<double>::UnitX()), Vec3<double>::Zero()));
  }
}

TEST_P(Screws, shift_along_z_is_the_dense_product) {
  const Matrix6 X = motion_transform(Mat3<double>::Identity(), {0, 0, offset});
  auto A = random_inertia(random), before = A;
  shift_z_back(A, offset);
  expect_equal(A, before, X);
}

TEST_P(Screws, shift_along_x_is_the_dense_product) {
  auto A = random_inertia(random), before = A;
  shift_x_back(A, offset);
  expect_equal(A, before, motion_transform(Mat3<double>::Identity(), {offset, 0, 0}));
}

TEST_P(Screws, product_with_a_motion_is_the_dense_product) {
  const auto A = random_inertia(random);
  const Motion<double> motion{random.vector(1), random.vector(1)};
  const Force<double> wrench = A * motion;
  Eigen::Matrix<double, 6, 1> m, f;
  m << motion.angular, motion.linear;
  f << wrench.moment, wrench.force;
  EXPECT_LT((f - dense(A) * m).norm(), 1e-14);
}

TEST_P(Screws, rigid_body_as_articulated_inertia_gives_the_same_wrench) {
  RigidInertia<double> body;
  body.mass = 1.3;
  body.h = random.vector(1);
  body.inertia = {1, 2, 3, 0.1, 0.2, 0.3};
  const Motion<double> motion{random.vector(1), random.vector(1)};
  const Force<double> one = body * motion, other = articulated(body) * motion;
  EXPECT_LT((one.moment - other.moment).norm() + (one.force - other.force).norm(), 1e-14);
}

}  // namespace
}  // namespace redysim
