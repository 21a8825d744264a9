#include <gtest/gtest.h>

#include <cmath>

#include "unit/model/read.hpp"

// [[trajectory]] and [controller] of a model file.

namespace redysim {
namespace {

using test::errors;
using test::Lines;
using test::read;
using test::warnings;

const std::string moved = test::arm + "drive = 'motion'\nq = 30\n";  // lines 6, 7
const std::string degrees = "angle_unit = 'deg'\n" + moved;          // one line more
const std::string pi = "3.14159265358979323846";

Trajectory only(const std::string& fields) {
  const Model model = read(degrees + "[[trajectory]]\njoint = 'a'\n" + fields);
  EXPECT_EQ(model.trajectories.size(), 1u);
  return model.trajectories.at(0);
}

TEST(trajectory_reader, a_move_starts_at_the_joints_start_in_the_files_unit) {
  const Trajectory cycloid = only("type = 'cycloid'\nto = 90\nduration = 2\nstart = 0.5\n");
  EXPECT_EQ(cycloid.kind, Trajectory::Kind::cycloid);
  EXPECT_DOUBLE_EQ(cycloid.from, M_PI / 6);
  EXPECT_DOUBLE_EQ(cycloid.to, M_PI / 2);
  EXPECT_EQ(cycloid.begin, 0.5);
  EXPECT_EQ(cycloid.end, 2.5);
}

TEST(trajectory_reader, speed_and_polynomial_have_no_end_unless_given_one) {
  const Trajectory speed = only("type = 'speed'\nspeed = 180\n");
  EXPECT_TRUE(std::isinf(speed.begin) && std::isinf(speed.end));
  EXPECT_DOUBLE_EQ(speed.pieces[0].coefficients[1], M_PI);
  EXPECT_TRUE(std::isinf(only("type = 'polynomial'\ncoefficients = [1]\n").end));
  EXPECT_EQ(only("type = 'polynomial'\ncoefficients = [1]\nstart = 1\nduration = 2\n").end, 3);
}

TEST(trajectory_reader, a_prismatic_joint_knows_no_degrees) {
  const Model model = read("angle_unit = 'deg'\n" + test::arm +
                           "joint = 'prismatic'\ndrive = 'motion'\n"
                           "[[trajectory]]\njoint = 'a'\ntype = 'quintic'\nfrom = 1\nto = 2\nduration = 1\n");
  EXPECT_EQ(model.trajectories[0].pieces[0].coefficients[0], 1);
}

TEST(trajectory_reader, refuses_what_it_cannot_use) {
  const auto with = [](const std::string& text) { return errors(moved + "[[trajectory]]\n" + text); };
  EXPECT_EQ(with("type = 'cycloid'\n"), Lines{"8: trajectory 1: joint is required"});
  EXPECT_EQ(with("joint = 'aa'\ntype = 'cycloid'\n"),
            Lines{"9: trajectory 1: joint 'aa' is not a moving joint with one DOF"});
  EXPECT_EQ(with("joint = 'a'\n"), Lines{"8: trajectory 1: type is required"});
  EXPECT_EQ(with("joint = 'a'\ntype = 'cycloid'\nto = 1\n"), Lines{"8: trajectory 1: duration is required"});
  EXPECT_EQ(with("joint = 'a'\ntype = 'cycloid'\nto = 1\nduration = 0\n"),
            Lines{"12: trajectory 1: duration must be > 0, got 0"});
  for (const char* type : {"cycloid", "cubic", "quintic"})
    for (const char* times : {"1e-200\n", "1e-20\nstart = 1\n"})
      EXPECT_EQ(with("joint = 'a'\ntype = '" + std::string(type) + "'\nto = 1\nduration = " + times),
                Lines{"12: trajectory 1: the trajectory is too short: its velocities and accelerations are "
                      "not finite"});
  EXPECT_EQ(with("joint = 'a'\ntype = 'cycloid'\nto = 1\nduration = 1\nspeed = 2\n"),
            Lines{"13: trajectory 1: speed does not apply to this type of trajectory"});
  EXPECT_EQ(with("joint = 'a'\ntype = 'speed'\n"), Lines{"8: trajectory 1: speed is required"});
  EXPECT_EQ(with("joint = 'a'\ntype = 'polynomial'\ncoefficients = []\n"),
            Lines{"11: trajectory 1: coefficients must contain at least one number"});
  EXPECT_EQ(with("joint = 'a'\ntype = 'table'\ntime = [0, 1]\nq = [0]\n"),
            Lines{"11: trajectory 1: q must be as long as time, 2 numbers, got 1"});
  EXPECT_EQ(with("joint = 'a'\ntype = 'table'\n").size(), 2u);
  EXPECT_EQ(with("joint = 'a'\ntype = 'table'\nfile = '../a.csv'\n"),
            Lines{"11: trajectory 1: file '../a.csv' has a name that is not allowed; it must be a file "
                  "beside the model file"});
  EXPECT_EQ(
      with("joint = 'a'\ntype = 'table'\nfile = 'none.csv'\n"),
      Lines{"11: trajectory 1: file 'none.csv' does not exist; it must be a file beside the model file"});
  const std::string whole = "joint = 'a'\ntype = 'speed'\nspeed = 1\n";
  EXPECT_EQ(with(whole + "[[trajectory]]\n" + whole),
            Lines{"13: trajectory 2: joint 'a' already has a trajectory"});
}

TEST(trajectory_reader, warns_of_a_trajectory_that_nothing_follows) {
  const std::string tail = "[[trajectory]]\njoint = 'a'\ntype = 'speed'\nspeed = 1\n";
  EXPECT_EQ(
      warnings(test::arm + tail),
      Lines{"7: trajectory 1: the trajectory has no effect: the drive of joint 'a' is not 'motion' and no "
            "controller follows it"});
  EXPECT_TRUE(warnings(moved + tail).empty());
  EXPECT_TRUE(warnings(test::arm + tail + "[controller]\nlaw = 'pd'\nkp = 1\nkd = 1\n").empty());
}

TEST(controller_reader, gains_and_targets_are_numbers_or_lists) {
  const Model model = read("angle_unit = 'deg'\n" + test::arms +
                           "q = 45\n[controller]\nlaw = 'computed_torque'\nkp = [1, 2]\nkd = 3\n");
  const auto& joints = model.controller.joints;
  ASSERT_EQ(joints.size(), 2u);
  EXPECT_EQ(joints[0].kp, 1);
  EXPECT_EQ(joints[1].kp, 2);
  EXPECT_EQ(joints[1].kd, 3);
  EXPECT_EQ(joints[0].target, 0);
  EXPECT_DOUBLE_EQ(joints[1].target, M_PI / 4);
  EXPECT_FALSE(model.controller.input);
}

TEST(controller_reader, refuses_what_it_cannot_use) {
  const auto with = [](const std::string& text) { return errors(test::arms + "[controller]\n" + text); };
  const std::string gains = "kp = 1\nkd = 1\n";
  EXPECT_EQ(with(gains), Lines{"10: controller: law is required"});
  EXPECT_EQ(with("law = 'pid'\n" + gains).size(), 1u);
  EXPECT_EQ(with("law = 'pd'\nkp = 1\n"), Lines{"10: controller: kd is required"});
  EXPECT_EQ(with("law = 'pd'\nkp = [1, 2, 3]\nkd = 1\n"),
            Lines{"12: controller: kp must be a number or a list of 2, got 3 numbers"});
  EXPECT_EQ(with("law = 'pd'\nkp = [1, -2]\nkd = 1\n"), Lines{"12: controller: kp must be >= 0, got -2"});
  EXPECT_EQ(with("law = 'pd'\nkp = -1\nkd = 1\n"), Lines{"12: controller: kp must be >= 0, got -1"});
  EXPECT_EQ(with("law = 'pd'\njoints = ['a', 'c', 'a']\n" + gains).size(), 2u);
  EXPECT_EQ(
      with("law = 'feed_forward'\njoints = ['a']\n" + gains),
      Lines{"11: controller: feed_forward requires a reference of every joint, but 'b' is not controlled; "
            "use computed_torque"});
  EXPECT_EQ(errors(moved + "[controller]\nlaw = 'pd'\n" + gains),
            Lines{"8: controller: no joint has drive 'torque'"});
  EXPECT_EQ(errors(moved + "[controller]\nlaw = 'pd'\njoints = ['a']\n" + gains),
            Lines{"10: controller: joints: the drive of 'a' must be 'torque'"});
}

TEST(controller_reader, feed_forward_refuses_loops) {
  const std::string loop =
      "[[loop]]\nname = 'pin'\ntype = 'point'\nlink_a = 'a'\nlink_b = 'b'\ndirections = [[1, 0, 0]]\n";
  EXPECT_EQ(
      errors(test::arms + loop + "[controller]\nlaw = 'feed_forward'\nkp = 1\nkd = 1\n"),
      Lines{"17: controller: feed_forward does not support loops and rigid couplings; use computed_torque or "
            "gravity_compensation"});
}

TEST(controller_reader, the_inverse_model_follows_trajectories_without_a_controller) {
  const Model model = read("inverse = true\n" + test::arms +
                           "[controller]\nlaw = 'pd'\nkp = 1\nkd = 1\n"
                           "[[trajectory]]\njoint = 'a'\ntype = 'speed'\nspeed = 1\n"
                           "[fmu]\ntunable = ['a.kp', 'a.damping', 'b.target']\n");
  EXPECT_EQ(model.controller.law, Law::none);
  EXPECT_TRUE(model.controller.joints.empty());
  EXPECT_EQ(model.trajectories.size(), 1u);
  EXPECT_EQ(model.fmu.tunable, std::vector<std::string>{"a.damping"});
}

}  // namespace
}  // namespace redysim
