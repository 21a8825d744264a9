#include "dynamics/rnea.hpp"

#include <gtest/gtest.h>

#include "unit/dynamics/planar_arm.hpp"

namespace redysim {
namespace {

using test::arm_q;
using test::arm_qd;
using test::vector_of;

TEST(InverseDynamics, is_inertia_coriolis_and_weight) {
  const test::PlanarArm arm;
  test::Evaluate<double> evaluate(arm.model);
  const test::Vector rest = vector_of({0, 0}), qdd = vector_of({0.8, 2.1});
  EXPECT_LT(test::relative_difference(evaluate.tau(arm_q, rest, rest), arm.weight(arm_q)), 1e-14);
  const test::Vector all = arm.inertia(arm_q) * qdd + arm.coriolis(arm_q, arm_qd) + arm.weight(arm_q);
  EXPECT_LT(test::relative_difference(evaluate.tau(arm_q, arm_qd, qdd), all), 1e-14);
}

}  // namespace
}  // namespace redysim
