#include "model/dh.hpp"

#include <gtest/gtest.h>

#include "support/random_tree.hpp"

namespace redysim {
namespace {

double difference(const Pose& a, const Pose& b) {
  return std::max((a.rotation - b.rotation).lpNorm<Eigen::Infinity>(),
                  (a.position - b.position).lpNorm<Eigen::Infinity>());
}

// Khalil and Kleinfinger 1986, eq. (3) with gamma = b = 0: the same matrix as Craig 2005, eq. (3.6).
TEST(PoseOf, is_craigs_matrix_without_a_branch) {
  const double alpha = 0.7, a = 0.3, theta = -1.2, d = 0.5;
  const Pose pose = pose_of({0, 0, alpha, a, theta, d});
  const double ct = std::cos(theta), st = std::sin(theta), ca = std::cos(alpha), sa = std::sin(alpha);
  Mat3<double> expected;
  expected << ct, -st, 0, st * ca, ct * ca, -sa, st * sa, ct * sa, ca;
  EXPECT_LT((pose.rotation - expected).lpNorm<Eigen::Infinity>(), 1e-15);
  EXPECT_LT((pose.position - Vec3<double>(a, -sa * d, ca * d)).norm(), 1e-15);
}

TEST(DhOf, finds_six_parameters_of_any_pose) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    const Pose pose = pose_of({random.between(-3, 3), random.between(-2, 2), random.between(-3, 3),
                               random.between(-2, 2), random.between(-3, 3), random.between(-2, 2)});
    EXPECT_LT(difference(pose_of(dh_of(pose)), pose), 1e-13);
  }
}

TEST(DhOf, finds_them_for_parallel_and_opposed_axes) {
  const double half = std::acos(-1.0);
  for (const double alpha : {0.0, half, -half})
    for (const double a : {0.0, 0.4, -0.4}) {
      const Pose pose = pose_of({0.3, 0.2, alpha, a, -0.8, 0.6});
      EXPECT_LT(difference(pose_of(dh_of(pose)), pose), 1e-14) << alpha << ' ' << a;
    }
}

TEST(DhOf, gives_back_what_a_serial_link_was_given) {
  const DhParameters dh = dh_of(pose_of({0, 0, 0.7, 0.3, -1.2, 0.5}));
  EXPECT_NEAR(dh.gamma, 0, 1e-15);
  EXPECT_NEAR(dh.b, 0, 1e-15);
  EXPECT_NEAR(dh.alpha, 0.7, 1e-15);
  EXPECT_NEAR(dh.a, 0.3, 1e-15);
  EXPECT_NEAR(dh.theta, -1.2, 1e-15);
  EXPECT_NEAR(dh.d, 0.5, 1e-15);
}

}  // namespace
}  // namespace redysim
