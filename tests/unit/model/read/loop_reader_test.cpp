#include "model/read/loop_reader.hpp"

#include <gtest/gtest.h>

#include "unit/model/read.hpp"

namespace redysim::test {
namespace {

// `fields` start on line 12, in a loop between link b and ground.
std::string loop(const std::string& type, const std::string& fields) {
  return arms + "[[loop]]\nname = 'l'\n" + "type = '" + type + "'\nlink_a = 'b'\nlink_b = 'ground'\n" +
         fields + "\n";
}

TEST(loop, every_type_is_accepted) {
  for (const char* type : {"spherical", "revolute", "prismatic", "cylindrical", "universal", "fixed"})
    EXPECT_TRUE(errors(loop(type, "")).empty()) << type;
  EXPECT_TRUE(errors(loop("point", "directions = [[1, 0, 0]]")).empty());
}

TEST(loop, its_required_fields_are_asked_for) {
  EXPECT_EQ(errors(arms + "[[loop]]\n"),
            (Lines{"10: loop 1: name is required", "10: loop 1: type is required",
                   "10: loop 1: link_a is required (a link's name or \"ground\")",
                   "10: loop 1: link_b is required (a link's name or \"ground\")"}));
}

TEST(loop, an_unknown_link_is_named) {
  EXPECT_EQ(errors(arms + "[[loop]]\nname = 'l'\ntype = 'spherical'\nlink_a = 'grund'\nlink_b = 'b'\n"),
            (Lines{"13: loop 'l': link_a 'grund' is not a link; did you mean 'ground'?"}));
}

TEST(loop, its_two_links_differ) {
  EXPECT_EQ(errors(arms + "[[loop]]\nname = 'l'\ntype = 'spherical'\nlink_a = 'b'\nlink_b = 'b'\n"),
            (Lines{"14: loop 'l': link_a and link_b are both 'b'; this loop has no effect"}));
}

TEST(loop, rigidly_connected_links_are_refused) {
  const std::string tools =
      "[[link]]\nname = 't'\njoint = 'fixed'\n[[link]]\nname = 'u'\njoint = 'fixed'\nparent = 'b'\n"
      "[[link]]\nname = 'w'\njoint = 'fixed'\nparent = 'ground'\n[[loop]]\nname = 'l'\ntype = 'spherical'\n";
  EXPECT_EQ(
      errors(arms + tools + "link_a = 't'\nlink_b = 'u'\n"),
      (Lines{"25: loop 'l': link_a 't' and link_b 'u' are rigidly connected; this loop has no effect"}));
  EXPECT_EQ(
      errors(arms + tools + "link_a = 'w'\nlink_b = 'ground'\n"),
      (Lines{"25: loop 'l': link_a 'w' and link_b ground are rigidly connected; this loop has no effect"}));
  EXPECT_TRUE(errors(arms + tools + "link_a = 'a'\nlink_b = 'u'\n").empty());
}

TEST(loop, directions_belong_to_point_loops) {
  EXPECT_EQ(errors(loop("revolute", "directions = [[1, 0, 0]]")),
            (Lines{"15: loop 'l': directions belong to loops of type 'point' only"}));
  EXPECT_EQ(errors(loop("point", "")),
            (Lines{"10: loop 'l': directions is required for type 'point', such as [[1, 0, 0], [0, 1, 0]]"}));
}

TEST(loop, directions_are_one_to_three_and_independent) {
  EXPECT_EQ(errors(loop("point", "directions = []")),
            (Lines{"15: loop 'l': directions must be 1 to 3, got 0"}));
  EXPECT_EQ(errors(loop("point", "directions = [[1, 0, 0], [2, 0, 0]]")),
            (Lines{"15: loop 'l': directions must be linearly independent"}));
  EXPECT_EQ(errors(loop("point", "directions = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]")),
            (Lines{"15: loop 'l': directions must be 1 to 3, got 4"}));
  EXPECT_EQ(errors(loop("point", "directions = [[1, 0, 0], [0, 0, 0]]")),
            (Lines{"15: loop 'l': directions must not be the zero vector"}));
  EXPECT_EQ(errors(loop("point", "directions = [1, 0, 0]")),
            (Lines(3, "15: loop 'l': directions must contain lists of 3 numbers, got a number")));
}

TEST(loop, its_axis_is_not_zero) {
  EXPECT_EQ(errors(loop("revolute", "axis_a = [0, 0, 0]")),
            (Lines{"15: loop 'l': axis_a must not be the zero vector"}));
}

TEST(loop, x_is_not_parallel_to_the_axis_where_it_matters) {
  EXPECT_EQ(errors(loop("prismatic", "x_a = [0, 0, 2]")),
            (Lines{"15: loop 'l': x_a must not be parallel to axis_a"}));
  EXPECT_EQ(errors(loop("fixed", "axis_b = [-1, 0, 0]")),
            (Lines{"10: loop 'l': x_b must not be parallel to axis_b"}));
  EXPECT_TRUE(errors(loop("universal", "axis_b = [1, 0, 0]")).empty());
}

TEST(loop, a_field_without_effect_warns) {
  EXPECT_EQ(warnings(loop("spherical", "axis_a = [1, 0, 0]")),
            (Lines{"15: loop 'l': axis_a has no effect on this type of loop"}));
  EXPECT_EQ(warnings(loop("revolute", "x_b = [1, 0, 0]")),
            (Lines{"15: loop 'l': x_b has no effect on this type of loop"}));
}

TEST(spring, its_values_are_not_negative) {
  const std::string spring = arms + "[[spring]]\nname = 's'\nlink_a = 'a'\nlink_b = 'b'\n";
  for (const std::string field : {"stiffness", "damping", "rest_length"})
    EXPECT_EQ(errors(spring + field + " = -1\n"),
              (Lines{"14: spring 's': " + field + " must be >= 0, got -1"}));
}

TEST(spring, one_that_moves_nothing_warns) {
  EXPECT_EQ(warnings(arms + "[[spring]]\nname = 's'\nlink_a = 'a'\nlink_b = 'a'\n"),
            (Lines{"13: spring 's': link_a and link_b are both 'a'; this spring has no effect"}));
}

// `fields` start on line 14.
std::string bushing(const std::string& fields) {
  return arms + "[[bushing]]\nname = 's'\nlink_a = 'a'\nlink_b = 'b'\n" + fields + "\n";
}

TEST(bushing, its_numbers_are_along_and_about_the_axes_of_frame_a) {
  const Model model =
      read("angle_unit = 'deg'\n" +
           bushing("stiffness = [1, 2, 3, 4, 5, 6]\ndamping = [0, 0, 0, 7, 8, 9]\nrpy_a = [0, 0, 90]"));
  const Bushing& found = model.bushings.at(0);
  EXPECT_EQ(found.stiffness, Vec3<double>(1, 2, 3));
  EXPECT_EQ(found.turning_stiffness, Vec3<double>(4, 5, 6));
  EXPECT_EQ(found.damping, Vec3<double>(0, 0, 0));
  EXPECT_EQ(found.turning_damping, Vec3<double>(7, 8, 9));
  EXPECT_TRUE((found.rotation_a * Vec3<double>::UnitX()).isApprox(Vec3<double>::UnitY(), 1e-15));
  EXPECT_TRUE(found.rotation_b.isIdentity(0));
}

TEST(bushing, wrong_numbers_are_refused) {
  for (const std::string field : {"stiffness", "damping"}) {
    EXPECT_EQ(errors(bushing(field + " = [1, 2, 3]")),
              (Lines{"14: bushing 's': " + field + " must be 6 numbers (x, y, z, rx, ry, rz), got 3"}));
    EXPECT_EQ(errors(bushing(field + " = [1, 1, 1, 1, -1, 1]")),
              (Lines{"14: bushing 's': " + field + " must be >= 0, got -1"}));
  }
  EXPECT_EQ(errors(bushing("")), (Lines{"10: bushing 's': stiffness or damping is required"}));
  EXPECT_EQ(errors(bushing("stiffness = [1, 1, 1, 1, 1, 1]\nrest_length = 1")),
            (Lines{"15: bushing 's': unknown field 'rest_length'"}));
}

TEST(bushing, one_that_moves_nothing_warns) {
  EXPECT_EQ(
      warnings(arms + "[[bushing]]\nname = 's'\nlink_a = 'a'\nlink_b = 'a'\ndamping = [1, 1, 1, 1, 1, 1]\n"),
      (Lines{"13: bushing 's': link_a and link_b are both 'a'; this bushing has no effect"}));
}

}  // namespace
}  // namespace redysim::test
