#include "dynamics/joint_force.hpp"

#include <gtest/gtest.h>

#include "support/evaluate.hpp"
#include "support/mechanisms.hpp"

// The laws of dry friction and stops against what their sources demand.

namespace redysim {
namespace {

// A joint alone, its force without a drive.
struct Bearing {
  Plan<double> plan;

  explicit Bearing(const Joint& joint) : plan(model_of(joint)) {}
  static Model model_of(const Joint& joint) {
    Model model;
    model.links = {test::rod("rod", ground, 1, 1)};
    model.links[0].joint = joint;
    return model;
  }
  double force(double q, double qd) const { return joint_force(plan, 0, q, qd, 0.0); }
  double slope(double q, double qd, bool velocity) const {
    return joint_force(plan, 0, Dual(q, velocity ? 0 : 1), Dual(qd, velocity ? 1 : 0), Dual(0)).derivative;
  }
};

Joint rough() {
  Joint joint;
  joint.friction = 2;
  joint.static_friction = 3;
  joint.friction_velocity = 0.1;
  return joint;
}

Joint stopped() {
  Joint joint;
  joint.lower = -0.5;
  joint.upper = 0.7;
  joint.stop_stiffness = 400;
  joint.stop_damping = 0.8;
  joint.stop_width = 0.02;
  return joint;
}

TEST(Friction, is_largest_at_its_velocity_and_slides_at_its_own_value) {
  const Bearing bearing(rough());
  EXPECT_NEAR(bearing.force(0, 0.1), -(2 * std::tanh(4.0) + 1), 1e-14);
  // but for the slope of tanh at 4, 8 / v (1 - tanh^2)
  EXPECT_NEAR(bearing.slope(0, 0.1, true), 0, 80 * (1 - std::tanh(4.0) * std::tanh(4.0)) + 1e-12);
  EXPECT_NEAR(bearing.force(0, 1e3), -2, 1e-10);
  EXPECT_EQ(bearing.force(0, 0), 0);
  double peak = 0;
  for (double qd = 1e-4; qd < 1; qd *= 1.01) {
    EXPECT_EQ(bearing.force(0, qd), -bearing.force(0, -qd));
    EXPECT_LT(bearing.force(0, qd), 0);
    peak = std::max(peak, -bearing.force(0, qd));
  }
  EXPECT_NEAR(peak, 3, 2e-3);
}

TEST(Friction, below_the_sliding_one_has_no_peak) {
  Joint joint = rough();
  joint.static_friction = 0;
  const Bearing bearing(joint);
  for (double qd : {-2.0, -0.03, 0.05, 0.1, 4.0})
    EXPECT_DOUBLE_EQ(bearing.force(0, qd), -2 * std::tanh(40 * qd));
}

TEST(Friction, only_takes_energy) {
  const Bearing bearing(rough());
  for (double qd : {-2.0, -0.03, 0.05, 0.1, 4.0})
    EXPECT_DOUBLE_EQ(joint_loss(bearing.plan, 0, 0.3, qd), bearing.force(0.3, qd) * qd);
}

TEST(Stop, is_silent_between_its_limits) {
  const Bearing bearing(stopped());
  for (double q : {-0.5, 0.0, 0.7})
    for (double qd : {-3.0, 0.0, 3.0}) EXPECT_EQ(bearing.force(q, qd), 0);
}

TEST(Stop, becomes_a_spring_behind_its_width) {
  const Bearing bearing(stopped());
  for (double x : {0.02, 0.03, 0.4}) {
    EXPECT_NEAR(bearing.force(0.7 + x, 0), -400 * (x - 0.01), 1e-11);
    EXPECT_NEAR(bearing.force(-0.5 - x, 0), 400 * (x - 0.01), 1e-11);
    EXPECT_NEAR(joint_energy(bearing.plan, 0, 0.7 + x),
                400 * (0.15 * 4e-4 + 0.5 * (x * x - 4e-4) - 0.01 * (x - 0.02)), 1e-12);
  }
}

// Force, slope and bend are continuous at the onset and at the width; the force is the energy's slope.
TEST(Stop, begins_with_two_continuous_derivatives) {
  const Bearing bearing(stopped());
  const double h = 1e-6;
  for (double at : {-0.52, -0.5, 0.7, 0.72}) {
    EXPECT_NEAR(bearing.slope(at - h, 0.4, false), bearing.slope(at + h, 0.4, false), 0.1) << at;
    const auto bend = [&](double q) {
      return (bearing.slope(q + h, 0.4, false) - bearing.slope(q - h, 0.4, false)) / (2 * h);
    };
    EXPECT_NEAR(bend(at - 2 * h), bend(at + 2 * h), 40) << at;  // of 5e4 in between
  }
  for (double q : {-0.6, -0.51, -0.2, 0.701, 0.715, 0.9})
    EXPECT_NEAR(bearing.force(q, 0), -joint_energy(bearing.plan, 0, Dual(q, 1)).derivative, 1e-12);
}

TEST(Stop, never_pulls_and_only_takes_energy) {
  const Bearing bearing(stopped());
  for (double x : {1e-9, 0.005, 0.02, 0.5})
    for (double qd : {-1e9, -20.0, -1.0, -1e-3, 0.0, 0.7, 1e3}) {
      EXPECT_LE(bearing.force(0.7 + x, qd), 0);
      EXPECT_GE(bearing.force(-0.5 - x, qd), 0);
      EXPECT_LE(joint_loss(bearing.plan, 0, 0.7 + x, qd), 0);
      EXPECT_LE(joint_loss(bearing.plan, 0, -0.5 - x, qd), 0);
    }
  // Hunt and Crossley's 1 + damping x' nearby
  EXPECT_NEAR(bearing.force(0.8, 1e-4) / bearing.force(0.8, 0), 1 + 0.8e-4, 1e-8);
}

}  // namespace
}  // namespace redysim
