#include "dynamics/energy.hpp"

#include <gtest/gtest.h>

#include "unit/dynamics/planar_arm.hpp"

namespace redysim {
namespace {

using test::arm_q;
using test::arm_qd;

TEST(Energy, kinetic_is_the_quadratic_form_of_the_inertia) {
  const test::PlanarArm arm;
  EXPECT_NEAR(test::Evaluate<double>(arm.model).kinetic(arm_q, arm_qd),
              0.5 * arm_qd.dot(arm.inertia(arm_q) * arm_qd), 1e-14);
}

TEST(Energy, potential_is_weight_times_height) {
  const test::PlanarArm arm;
  const double upper = arm.l1 / 2 * std::sin(arm_q[0]),
               lower = arm.l1 * std::sin(arm_q[0]) + arm.l2 / 2 * std::sin(arm_q[0] + arm_q[1]);
  EXPECT_NEAR(test::Evaluate<double>(arm.model).potential(arm_q, arm_qd),
              arm.g * (arm.m1 * upper + arm.m2 * lower), 1e-14);
}

TEST(Energy, joint_spring_stores_half_k_x_squared) {
  test::PlanarArm arm;
  const double without = test::Evaluate<double>(arm.model).potential(arm_q, arm_qd);
  arm.model.links[1].joint.stiffness = 30;
  arm.model.links[1].joint.rest = 0.2;
  EXPECT_NEAR(test::Evaluate<double>(arm.model).potential(arm_q, arm_qd) - without,
              0.5 * 30 * std::pow(arm_q[1] - 0.2, 2), 1e-13);
}

TEST(Energy, power_of_drives_and_dampers) {
  test::PlanarArm arm;
  arm.model.links[0].joint.damping = 0.3;
  const test::Vector tau = test::vector_of({3, -1});
  EXPECT_NEAR(test::Evaluate<double>(arm.model).power(arm_q, arm_qd, tau),
              tau.dot(arm_qd) - 0.3 * arm_qd[0] * arm_qd[0], 1e-13);
}

}  // namespace
}  // namespace redysim
