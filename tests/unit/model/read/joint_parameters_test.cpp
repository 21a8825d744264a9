#include "model/read/joint_parameters.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "unit/model/read.hpp"

namespace redysim::test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double degree = 3.14159265358979323846 / 180;

Joint joint_with(const std::string& fields) { return read(arm + fields).links.at(0).joint; }

TEST(joint_parameters, are_absent_unless_given) {
  const Joint joint = joint_with("");
  EXPECT_EQ(joint.friction, 0);
  EXPECT_FALSE(has_stops(joint));
  EXPECT_EQ(joint.stop_width, 0.01);
  EXPECT_EQ(joint_with("joint = 'prismatic'\n").stop_width, 0.001);
}

TEST(joint_parameters, are_read) {
  const Joint joint = joint_with(
      "friction = 2\nstatic_friction = 3\nfriction_velocity = 0.1\nlower = -1\nstop_stiffness = 50\n"
      "stop_damping = 0.5\nstop_width = 0.2\n");
  EXPECT_EQ(joint.friction, 2);
  EXPECT_EQ(joint.static_friction, 3);
  EXPECT_EQ(joint.friction_velocity, 0.1);
  EXPECT_EQ(joint.lower, -1);
  EXPECT_EQ(joint.upper, infinity);
  EXPECT_EQ(joint.stop_stiffness, 50);
  EXPECT_EQ(joint.stop_damping, 0.5);
  EXPECT_EQ(joint.stop_width, 0.2);
}

TEST(joint_parameters, of_angles_come_in_the_files_unit) {
  const std::string fields =
      "friction = 1\nfriction_velocity = 2\nupper = 90\nstop_stiffness = 50\nstop_width = 3\n";
  const std::string degrees = "angle_unit = 'deg'\n" + arm + fields;
  const Joint turns = read(degrees).links.at(0).joint,
              slides = read(degrees + "joint = 'prismatic'\n").links.at(0).joint;
  EXPECT_DOUBLE_EQ(turns.upper, 90 * degree);
  EXPECT_DOUBLE_EQ(turns.stop_width, 3 * degree);
  EXPECT_DOUBLE_EQ(turns.friction_velocity, 2 * degree);
  EXPECT_EQ(turns.stop_stiffness, 50);
  EXPECT_EQ(slides.upper, 90);
  EXPECT_EQ(slides.friction_velocity, 2);
}

TEST(joint_parameters, have_bounds) {
  for (const std::string field : {"friction", "static_friction", "stop_stiffness", "stop_damping"})
    EXPECT_EQ(errors(arm + field + " = -2\n").at(0), "6: link 'a': " + field + " must be >= 0, got -2");
  for (const std::string field : {"friction_velocity", "stop_width"})
    EXPECT_EQ(errors(arm + field + " = 0\n").at(0), "6: link 'a': " + field + " must be > 0, got 0");
}

TEST(joint_parameters, that_contradict_each_other_are_refused) {
  EXPECT_EQ(errors(arm + "friction = 2\nstatic_friction = 1\n"),
            (Lines{"7: link 'a': static_friction must be >= friction, 2, got 1"}));
  EXPECT_EQ(errors(arm + "lower = 1\nupper = 0.5\nstop_stiffness = 1\n"),
            (Lines{"7: link 'a': upper must be greater than lower"}));
  EXPECT_EQ(errors(arm + "upper = 0.5\n"), (Lines{"6: link 'a': stop_stiffness is required with a stop"}));
}

TEST(joint_parameters, without_effect_are_warned_about) {
  EXPECT_EQ(warnings(arm + "friction_velocity = 1\n"),
            (Lines{"6: link 'a': friction_velocity has no effect without friction"}));
  EXPECT_EQ(warnings(arm + "stop_stiffness = 1\nstop_damping = 1\n"),
            (Lines{"6: link 'a': stop_stiffness has no effect without lower or upper",
                   "7: link 'a': stop_damping has no effect without lower or upper"}));
  EXPECT_EQ(warnings(arm + "friction = 1\ndamping = 1\narmature = 1\ndrive = 'locked'\n"),
            (Lines{"6: link 'a': friction has no effect on a locked joint",
                   "7: link 'a': damping has no effect on a locked joint",
                   "8: link 'a': armature has no effect on a locked joint"}));
  EXPECT_EQ(warnings(arms + "joint = 'fixed'\nfriction = 1\nlower = 0\nstop_stiffness = 1\n").size(), 3u);
}

TEST(joint_parameters, a_start_beyond_a_stop_is_warned_about) {
  const std::string stops = arm + "lower = -1\nupper = 1\nstop_stiffness = 1\n";
  EXPECT_TRUE(warnings(stops + "q = 1\n").empty());
  EXPECT_EQ(warnings(stops + "q = 1.5\n"), (Lines{"9: link 'a': q starts beyond the stop at upper"}));
  EXPECT_EQ(warnings(stops + "q = -1.5\n"), (Lines{"9: link 'a': q starts beyond the stop at lower"}));
  EXPECT_EQ(warnings(arm + "lower = 1\nstop_stiffness = 1\n"),
            (Lines{"6: link 'a': q starts beyond the stop at lower"}));
}

TEST(joint_parameters, of_several_freedoms_are_lists) {
  const Model model =
      read(arm +
           "joint = 'cylindrical'\nfriction = [1, 0]\nlower = [-inf, -0.1]\nupper = [inf, 0.2]\n"
           "stop_stiffness = [0, 100]\nstop_width = [0.1, 0.01]\n");
  const Joint &turn = model.links.at(0).joint, &slide = model.links.at(1).joint;
  EXPECT_EQ(turn.friction, 1);
  EXPECT_FALSE(has_stops(turn));
  EXPECT_EQ(slide.friction, 0);
  EXPECT_EQ(slide.lower, -0.1);
  EXPECT_EQ(slide.upper, 0.2);
  EXPECT_EQ(slide.stop_stiffness, 100);
}

TEST(joint_parameters, of_several_freedoms_are_checked_each) {
  const std::string planar = arm + "joint = 'planar'\n";
  EXPECT_EQ(errors(planar + "friction = [0, -1, 0]\n"),
            (Lines{"7: link 'a': friction must be >= 0, got -1"}));
  EXPECT_EQ(errors(planar + "friction = [0, 1]\n"),
            (Lines{"7: link 'a': friction must be 3 numbers, got 2"}));
  EXPECT_EQ(errors(planar + "friction = [0, inf, 0]\n"),
            (Lines{"7: link 'a': friction must be finite, got inf"}));
  EXPECT_EQ(errors(planar + "lower = [0, 0, 0]\nupper = [1, -1, 1]\nstop_stiffness = [1, 1, 1]\n"),
            (Lines{"8: link 'a': upper of DOF 2 must be greater than lower"}));
  EXPECT_EQ(errors(arm + "joint = 'spherical'\nfriction = 1\n").size(), 1u);
}

TEST(joint_parameters, are_tunable_where_they_exist) {
  const std::string tunable = "[fmu]\ntunable = ['a.friction', 'a.stop_width', 'a.upper']\n";
  EXPECT_TRUE(errors(arm + "upper = 1\nstop_stiffness = 1\n" + tunable).empty());
  EXPECT_EQ(errors(arm + tunable).size(), 1u);
}

}  // namespace
}  // namespace redysim::test
