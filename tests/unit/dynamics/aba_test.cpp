#include "dynamics/aba.hpp"

#include <gtest/gtest.h>

#include "unit/dynamics/planar_arm.hpp"

namespace redysim {
namespace {

using test::arm_q;
using test::arm_qd;
using test::vector_of;

TEST(ForwardDynamics, two_rods_follow_their_equations) {
  const test::PlanarArm arm;
  const test::Vector tau = vector_of({3, -1});
  const test::Vector qdd =
      arm.inertia(arm_q).ldlt().solve(tau - arm.coriolis(arm_q, arm_qd) - arm.weight(arm_q));
  EXPECT_LT(test::relative_difference(test::Evaluate<double>(arm.model).qdd(arm_q, arm_qd, tau), qdd), 1e-14);
}

TEST(ForwardDynamics, slider_feels_its_mass_armature_and_weight) {
  Model model;
  model.name = "slider";
  model.gravity = {0, 0, -9.81};
  model.links = {test::rod("slider", ground, 0.3, 2)};
  model.links[0].joint.type = JointType::prismatic;
  model.links[0].joint.armature = 0.5;
  const test::Vector qdd =
      test::Evaluate<double>(model).qdd(vector_of({0.1}), vector_of({4}), vector_of({7}));
  EXPECT_NEAR(qdd[0], (7 - 2 * 9.81) / 2.5, 1e-14);
}

}  // namespace
}  // namespace redysim
