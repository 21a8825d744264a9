#include "dynamics/crba.hpp"

#include <gtest/gtest.h>

#include "unit/dynamics/planar_arm.hpp"

namespace redysim {
namespace {

TEST(JointSpaceInertia, of_two_rods_is_the_closed_form) {
  const test::PlanarArm arm;
  const test::Matrix M = test::Evaluate<double>(arm.model).inertia(test::arm_q);
  EXPECT_LT((M - arm.inertia(test::arm_q)).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(JointSpaceInertia, armature_stands_on_the_diagonal) {
  test::PlanarArm arm;
  const test::Matrix without = test::Evaluate<double>(arm.model).inertia(test::arm_q);
  arm.model.links[1].joint.armature = 0.25;
  const test::Matrix with = test::Evaluate<double>(arm.model).inertia(test::arm_q) - without;
  EXPECT_NEAR(with(1, 1), 0.25, 1e-15);
  EXPECT_EQ(with(0, 0), 0);
  EXPECT_EQ(with(0, 1), 0);
}

}  // namespace
}  // namespace redysim
