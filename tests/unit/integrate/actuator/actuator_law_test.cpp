#include "integrate/actuator/actuator_law.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "math/dual.hpp"

namespace redysim {
namespace {

Actuator limited() {
  Actuator motor;
  motor.torque_limit = 10;
  motor.torque_limit_width = 2;
  motor.speed_limit = 5;
  motor.speed_limit_width = 1;
  return motor;
}

TEST(ActuatorLaw, torque_is_exact_below_its_limit_and_reaches_it) {
  const Actuator motor = limited();
  for (double side : {-1.0, 1.0}) {
    EXPECT_EQ(saturated_torque(motor, side * 9.0), side * 9.0);
    EXPECT_LT(side * saturated_torque(motor, side * 9.5), 9.5);
    EXPECT_DOUBLE_EQ(saturated_torque(motor, side * 11.0), side * 10);
    EXPECT_DOUBLE_EQ(saturated_torque(motor, side * 1e6), side * 10);
  }
}

TEST(ActuatorLaw, torque_is_smooth_at_both_ends_of_its_onset) {
  const Actuator motor = limited();
  constexpr double h = 1e-4;
  for (double at : {9.0, 11.0, -9.0, -11.0}) {
    const auto slope = [&](double torque) { return saturated_torque(motor, Dual(torque, 1)).derivative; };
    EXPECT_NEAR(slope(at + h), slope(at - h), 1e-6);
    EXPECT_NEAR((slope(at + h) - slope(at)) / h, (slope(at) - slope(at - h)) / h, 1e-3);
  }
}

TEST(ActuatorLaw, driving_torque_fades_out_at_the_speed_limit_and_braking_stays) {
  const Actuator motor = limited();
  for (double side : {-1.0, 1.0}) {
    EXPECT_EQ(torque_at_speed(motor, side * 8, side * 4.0), side * 8);
    EXPECT_DOUBLE_EQ(torque_at_speed(motor, side * 8, side * 4.5), side * 4);  // half way
    EXPECT_EQ(torque_at_speed(motor, side * 8, side * 5.0), 0);
    EXPECT_EQ(torque_at_speed(motor, side * 8, side * 50.0), 0);
    EXPECT_EQ(torque_at_speed(motor, side * 8, side * -50.0), side * 8);
  }
}

TEST(ActuatorLaw, saturation_is_the_part_that_limits_remove) {
  const auto saturation = [](double torque, double speed) {
    return respond(limited(), ActuatorPoint<double>{torque, 0, speed, 0, 0, 0, 0}).saturation;
  };
  EXPECT_EQ(saturation(0, 1), 0);
  EXPECT_EQ(saturation(8, 1), 0);
  EXPECT_DOUBLE_EQ(saturation(-20, 1), 0.5);
  EXPECT_DOUBLE_EQ(saturation(8, 4.5), 0.5);
  EXPECT_EQ(saturation(8, 6), 1);
}

TEST(ActuatorLaw, a_gear_passes_nothing_within_its_backlash_and_is_linear_beyond_the_width) {
  Actuator actuator;
  actuator.stiffness = 100;
  actuator.damping = 3;
  actuator.backlash = 0.2;
  actuator.backlash_width = 0.02;
  const ElasticLaw gear = gear_law(actuator);
  EXPECT_EQ(ElasticForce<double>(gear, 0.1, 5).elastic, 0);
  EXPECT_EQ(ElasticForce<double>(gear, -0.1, 5).damping, 0);
  const ElasticForce<double> pressed(gear, -0.5, 2);
  EXPECT_DOUBLE_EQ(pressed.elastic, -100 * (0.4 - 0.01));
  EXPECT_DOUBLE_EQ(pressed.damping, 3 * 2);
  // the torque is the derivative of the energy
  for (double twist : {-0.3, -0.11, 0.05, 0.105, 0.4}) {
    const ElasticForce<Dual> at(gear, Dual(twist, 1), Dual(0));
    EXPECT_NEAR(at.energy.derivative, at.elastic.value, 1e-12 * std::max(1.0, std::abs(at.elastic.value)));
  }
}

}  // namespace
}  // namespace redysim
