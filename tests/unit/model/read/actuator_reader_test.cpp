#include "model/read/actuator_reader.hpp"

#include <gtest/gtest.h>

#include "unit/model/read.hpp"

namespace redysim::test {
namespace {

// The table begins on line 6.
std::string with(const std::string& fields) { return arm + "[[actuator]]\njoint = 'a'\n" + fields; }
Actuator actuator_with(const std::string& fields) { return read(with(fields)).actuators.at(0); }

TEST(actuator, fields_are_read_and_widths_follow_from_limits) {
  const Actuator actuator = actuator_with(
      "gear_ratio = -50\nrotor_inertia = 1e-4\nstiffness = 100\ndamping = 2\nbacklash = 0.01\n"
      "torque_limit = 40\nspeed_limit = 8\ntime_constant = 0.002\nresistance = 2\ninductance = 0.01\n"
      "torque_constant = 0.05\n");
  EXPECT_EQ(actuator.link, 0);
  EXPECT_EQ(actuator.gear_ratio, -50);
  EXPECT_EQ(actuator.rotor_inertia, 1e-4);
  EXPECT_EQ(actuator.stiffness, 100);
  EXPECT_EQ(actuator.damping, 2);
  EXPECT_EQ(actuator.backlash, 0.01);
  EXPECT_EQ(actuator.backlash_width, 0.1 * 0.01);
  EXPECT_EQ(actuator.torque_limit, 40);
  EXPECT_EQ(actuator.torque_limit_width, 0.05 * 40);
  EXPECT_EQ(actuator.speed_limit, 8);
  EXPECT_EQ(actuator.speed_limit_width, 0.05 * 8);
  EXPECT_EQ(actuator.time_constant, 0.002);
  EXPECT_EQ(actuator.resistance, 2);
  EXPECT_EQ(actuator.inductance, 0.01);
  EXPECT_EQ(actuator.torque_constant, 0.05);
}

TEST(actuator, the_rotor_behind_a_rigid_gear_is_armature) {
  const Model model = read(with("gear_ratio = 10\nrotor_inertia = 0.02\n"));
  EXPECT_EQ(model.links[0].joint.armature, 10.0 * 10 * 0.02);
  EXPECT_FALSE(model.actuators[0].acts());
  EXPECT_EQ(read(with("rotor_inertia = 0.02\nstiffness = 5\n")).links[0].joint.armature, 0);
}

TEST(actuator, armature_lets_a_massless_joint_move_only_behind_a_rigid_gear) {
  const std::string light =
      "name = 'm'\n[[link]]\nname = 'a'\n[[actuator]]\njoint = 'a'\nrotor_inertia = 1\n";
  EXPECT_EQ(errors(light), Lines());
  EXPECT_EQ(errors(light + "stiffness = 5\n").size(), 1u);
}

TEST(actuator, bad_fields_are_refused_in_one_sentence) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"torque_limit = 0", "8: actuator 1: torque_limit must be > 0, got 0"},
      {"torque_limit = -2", "8: actuator 1: torque_limit must be > 0, got -2"},
      {"speed_limit = 0", "8: actuator 1: speed_limit must be > 0, got 0"},
      {"time_constant = 0", "8: actuator 1: time_constant must be > 0, got 0"},
      {"gear_ratio = 0", "8: actuator 1: gear_ratio must not be 0"},
      {"rotor_inertia = -1", "8: actuator 1: rotor_inertia must be >= 0, got -1"},
      {"damping = 1", "8: actuator 1: stiffness is required with damping"},
      {"backlash = 0.1", "8: actuator 1: stiffness is required with backlash"},
      {"stiffness = 10", "8: actuator 1: rotor_inertia is required with stiffness"},
      {"resistance = 1", "8: actuator 1: torque_constant is required with resistance"},
      {"torque_constant = 1", "8: actuator 1: resistance is required with torque_constant"},
      {"inductance = 1", "8: actuator 1: resistance is required with inductance"},
      {"torque_limit_width = 1", "8: actuator 1: torque_limit is required with torque_limit_width"},
      {"torque_limit = 2\ntorque_limit_width = 3",
       "9: actuator 1: torque_limit_width must be <= torque_limit, 2, got 3"},
      {"limit = 2", "8: actuator 1: unknown field 'limit'"},
  };
  for (const auto& [fields, message] : cases) EXPECT_EQ(errors(with(fields + "\n")), Lines{message});
}

TEST(actuator, joint_must_have_one_degree_of_freedom_and_drive_torque) {
  const auto refused = [](const std::string& link, const std::string& table) {
    return errors(arm + link + "[[actuator]]\n" + table);
  };
  EXPECT_EQ(refused("", "rotor_inertia = 1\n"), Lines{"6: actuator 1: joint is required"});
  EXPECT_EQ(refused("", "joint = 'b'\n"),
            Lines{"7: actuator 1: joint 'b' is not a moving joint with one DOF"});
  EXPECT_EQ(refused("joint = 'spherical'\n", "joint = 'a'\n"),
            Lines{"8: actuator 1: joint 'a' is not a moving joint with one DOF"});
  for (const char* drive : {"motion", "locked", "free"})
    EXPECT_EQ(refused("drive = '" + std::string(drive) + "'\n", "joint = 'a'\n"),
              Lines{"8: actuator 1: the drive of joint 'a' must be 'torque'"});
  EXPECT_EQ(refused("", "joint = 'a'\n[[actuator]]\njoint = 'a'\n"),
            Lines{"9: actuator 2: joint 'a' already has an actuator"});
  EXPECT_EQ(
      refused("armature = 1\n", "joint = 'a'\nrotor_inertia = 1\n"),
      Lines{"9: actuator 1: rotor_inertia and the armature of joint 'a' must not both be given: armature "
            "= gear_ratio^2 rotor_inertia"});
}

TEST(actuator, a_model_of_a_law_gives_no_voltage) {
  const std::string motor = with("resistance = 1\ntorque_constant = 1\n") + "[controller]\nkp = 1\nkd = 1\n";
  EXPECT_EQ(errors(motor + "law = 'pd'\n"), Lines());
  EXPECT_EQ(
      errors(motor + "law = 'gravity_compensation'\n"),
      Lines{"13: controller: the law needs torques, but the actuator of joint 'a' takes a voltage; use pd"});
}

TEST(actuator, computed_torque_needs_the_torques_of_joints_that_it_does_not_control) {
  const std::string text = arms + "[[actuator]]\njoint = 'b'\nresistance = 1\ntorque_constant = 1\n" +
                           "[controller]\nkp = 1\nkd = 1\njoints = ['a']\n";
  EXPECT_EQ(errors(text + "law = 'gravity_compensation'\n"), Lines());
  EXPECT_EQ(
      errors(text + "law = 'computed_torque'\n"),
      Lines{"18: controller: computed_torque needs the torques of all joints, but the actuator of joint "
            "'b' takes a voltage; use pd"});
}

TEST(actuator, a_ratio_without_effect_gives_a_warning) {
  EXPECT_EQ(warnings(with("gear_ratio = 3\n")),
            Lines{"8: actuator 1: gear_ratio has no effect without rotor_inertia or a DC motor"});
}

}  // namespace
}  // namespace redysim::test
