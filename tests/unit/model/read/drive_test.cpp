#include <gtest/gtest.h>

#include "unit/model/read.hpp"

namespace redysim::test {
namespace {

// Link b with these fields from line 10 on; link a is driven by a torque.
std::string b_with(const std::string& fields) { return arms + fields + "\n"; }

TEST(drive, is_a_torque_unless_told_otherwise) {
  EXPECT_EQ(read(arms).links.at(0).joint.drive, Drive::torque);
}

TEST(drive, has_four_kinds) {
  const std::pair<const char*, Drive> kinds[] = {
      {"torque", Drive::torque}, {"motion", Drive::motion}, {"locked", Drive::locked}, {"free", Drive::free}};
  for (const auto& [word, drive] : kinds)
    EXPECT_EQ(read(b_with("drive = '" + std::string(word) + "'")).links.at(1).joint.drive, drive) << word;
}

TEST(drive, of_another_kind_is_refused) {
  EXPECT_EQ(errors(b_with("drive = 'position'")),
            (Lines{"10: link 'b': drive must be 'torque', 'free', 'motion' or 'locked', got 'position'"}));
}

TEST(drive, has_no_effect_on_a_fixed_joint) {
  EXPECT_EQ(warnings(b_with("joint = 'fixed'\ndrive = 'motion'")),
            (Lines{"11: link 'b': drive has no effect on a fixed joint"}));
}

TEST(drive, of_a_prescribed_joint_needs_no_mass_to_move) {
  const std::string point =
      "name = 'm'\n[[link]]\nname = 'a'\nmass = 1\ncom = [1, 0, 0]\n[[link]]\nname = 'b'\n";
  EXPECT_EQ(errors(point).size(), 1u);
  for (const char* drive : {"motion", "locked"})
    EXPECT_TRUE(errors(point + "drive = '" + drive + "'\n").empty()) << drive;
}

TEST(inverse, turns_torques_into_motions_and_nothing_else) {
  const std::string rest = "[[link]]\nname = 'c'\njoint = 'fixed'\n";
  for (const char* drive : {"torque", "free", "motion", "locked"}) {
    const std::string text = b_with("drive = '" + std::string(drive) + "'\n") + rest;
    const Model model = read(text), inverse = read("inverse = true\n" + text);
    EXPECT_EQ(inverse.name, "m_inverse");
    EXPECT_EQ(inverse.links.at(0).joint.drive, Drive::motion);
    const Drive given = model.links.at(1).joint.drive;
    EXPECT_EQ(inverse.links.at(1).joint.drive, given == Drive::torque ? Drive::motion : given);
  }
}

TEST(inverse, leaves_joints_with_a_quaternion_alone) {
  const Model model = read("inverse = true\n" + b_with("joint = 'spherical'\n"));
  ASSERT_EQ(model.balls.size(), 1u);
  EXPECT_TRUE(model.balls[0].driven);
  EXPECT_EQ(model.links.at(0).joint.drive, Drive::motion);
}

TEST(inverse, may_be_said_to_be_off) {
  const Model model = read("inverse = false\n" + arms);
  EXPECT_EQ(model.name, "m");
  EXPECT_EQ(model.links.at(0).joint.drive, Drive::torque);
}

TEST(inverse, is_true_or_false) {
  EXPECT_EQ(errors("inverse = 1\n" + arms), (Lines{"1: inverse must be true or false, got a number"}));
}

TEST(inverse, of_a_model_without_torques_warns) {
  EXPECT_EQ(warnings("inverse = true\n" + arm + "drive = 'free'\n"),
            (Lines{"1: inverse has no effect: no joint has drive 'torque'"}));
}

}  // namespace
}  // namespace redysim::test
