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

Mat3<double> dense(const Symmetric3<double>& S) {
  Mat3<double> m;
  m << S.xx, S.xy, S.xz, S.xy, S.yy, S.yz, S.xz, S.yz, S.zz;
  return m;
}

Matrix6 dense(const ArticulatedInertia<double>& A) {
  Matrix6 m;
  m << dense(A.I), A.H, A.H.transpose(), dense(A.M);
  return m;
}

// Motion of the frame before -> of a frame turned by R and then moved to r.
Matrix6 motion_transform(const Mat3<double>& R, const Vec3<double>& r) {
  Matrix6 X;
  X << R.transpose(), Mat3<double>::Zero(), -R.transpose() * skew(r), R.transpose();
  return X;
}

ArticulatedInertia<double> random_inertia(test::Random& random, bool axis_free) {
  Matrix6 B;
  for (double& entry : B.reshaped()) entry = random.between(-1, 1);
  if (axis_free) B.row(2).setZero();
  ArticulatedInertia<double> A{{0, 0, 0, 0, 0, 0}, Mat3<double>::Zero(), {0, 0, 0, 0, 0, 0}};
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
  auto A = random_inertia(random, false), before = A;
  turn_z_back<false>(A, std::cos(angle), std::sin(angle));
  expect_equal(A, before, X);
  auto free = random_inertia(random, true), free_before = free;
  turn_z_back<true>(free, std::cos(angle), std::sin(angle));
  expect_equal(free, free_before, X);
}

TEST_P(Screws, turn_about_x_is_the_dense_product) {
  auto A = random_inertia(random, false), before = A;
  turn_x_back(A, std::cos(angle), std::sin(angle));
  expect_equal(A, before, motion_transform(about(Vec3<double>::UnitX()), Vec3<double>::Zero()));
}

TEST_P(Screws, quarter_turn_about_x_is_the_general_turn) {
  for (const double sign : {1.0, -1.0}) {
    auto A = random_inertia(random, false), before = A;
    quarter_turn_x_back(A, sign < 0);
    angle = sign * 1.5707963267948966;
    expect_equal(A, before, motion_transform(about(Vec3<double>::UnitX()), Vec3<double>::Zero()));
  }
}

TEST_P(Screws, shift_along_z_is_the_dense_product) {
  const Matrix6 X = motion_transform(Mat3<double>::Identity(), {0, 0, offset});
  auto A = random_inertia(random, false), before = A;
  shift_z_back<false>(A, offset);
  expect_equal(A, before, X);
  auto free = random_inertia(random, true), free_before = free;
  shift_z_back<true>(free, offset);
  expect_equal(free, free_before, X);
}

TEST_P(Screws, shift_along_x_is_the_dense_product) {
  auto A = random_inertia(random, false), before = A;
  shift_x_back(A, offset);
  expect_equal(A, before, motion_transform(Mat3<double>::Identity(), {offset, 0, 0}));
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
