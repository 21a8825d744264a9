#include "model/dh.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "support/random_tree.hpp"

namespace redysim {
namespace {

constexpr double pi = 3.14159265358979323846;

class Dh : public testing::TestWithParam<unsigned> {
 protected:
  test::Random random{GetParam()};
};
INSTANTIATE_TEST_SUITE_P(Seed, Dh, testing::Range(0u, 20u));

void expect_equal(const Pose& one, const Pose& other, double error) {
  EXPECT_LT((one.rotation - other.rotation).norm(), error);
  EXPECT_LT((one.position - other.position).norm(), error);
}

// Khalil and Kleinfinger (1986): T = Rot(z, gamma) Trans(z, b) Rot(x, alpha) Trans(x, a) Rot(z, theta)
// Trans(z, d)
TEST_P(Dh, pose_is_the_product_of_elementary_displacements) {
  const DhParameters dh{random.between(-3, 3), random.between(-1, 1), random.between(-3, 3),
                        random.between(-1, 1), random.between(-3, 3), random.between(-1, 1)};
  Eigen::Isometry3d product = Eigen::Isometry3d::Identity();
  product.rotate(Eigen::AngleAxisd(dh.gamma, Vec3<double>::UnitZ())).translate(Vec3<double>(0, 0, dh.b));
  product.rotate(Eigen::AngleAxisd(dh.alpha, Vec3<double>::UnitX())).translate(Vec3<double>(dh.a, 0, 0));
  product.rotate(Eigen::AngleAxisd(dh.theta, Vec3<double>::UnitZ())).translate(Vec3<double>(0, 0, dh.d));
  expect_equal(pose_of(dh), {product.linear(), product.translation()}, 1e-14);
}

TEST_P(Dh, every_pose_has_parameters) {
  const Eigen::AngleAxisd turn(random.between(0, pi), random.direction());
  const Pose pose{turn.toRotationMatrix(), random.vector(2)};
  expect_equal(pose_of(dh_of(pose)), pose, 1e-13);
}

TEST_P(Dh, so_have_parallel_and_opposite_axes) {
  for (const double tilt : {0.0, pi}) {
    const Eigen::AngleAxisd flip(tilt, Vec3<double>::UnitX()),
        turn(random.between(-3, 3), Vec3<double>::UnitZ());
    const Pose pose{(flip * turn).toRotationMatrix(), random.vector(2)};
    expect_equal(pose_of(dh_of(pose)), pose, 1e-13);
  }
}

TEST_P(Dh, a_pose_times_its_inverse_is_none) {
  const Eigen::AngleAxisd turn(random.between(0, pi), random.direction());
  const Pose pose{turn.toRotationMatrix(), random.vector(2)};
  expect_equal(pose * inverse(pose), Pose{}, 1e-14);
  expect_equal(inverse(pose) * pose, Pose{}, 1e-14);
}

}  // namespace
}  // namespace redysim
