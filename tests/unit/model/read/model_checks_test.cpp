#include "model/read/model_checks.hpp"

#include <gtest/gtest.h>

#include "unit/model/read.hpp"

namespace redysim::test {
namespace {

// A model of links "a", "b", ... each on the one before, from the fields of each.
std::string chain(const std::vector<std::string>& fields) {
  std::string text = "name = 'm'\n";
  char name = 'a';
  for (const std::string& field : fields)
    text += std::string("[[link]]\nname = '") + name++ + "'\n" + field + "\n";
  return text;
}

const std::string remedy = "; give its link mass or inertia, or the joint an armature";

TEST(inertia, a_negative_principal_moment_is_refused) {
  EXPECT_EQ(errors(chain({"mass = 1\ninertia = [1, 1, -1]"})),
            (Lines{"5: link 'a': inertia has a negative principal moment (-1, 1, 1)"}));
  EXPECT_EQ(errors(chain({"mass = 1\ninertia = [1, 1, 1, 2, 0, 0]"})),
            (Lines{"5: link 'a': inertia has a negative principal moment (-1, 1, 3)"}));
}

TEST(inertia, a_negative_moment_of_rounding_size_is_accepted) {
  EXPECT_TRUE(errors(chain({"mass = 1\ninertia = [1, 1, -1e-14]\ncom = [1, 0, 0]"})).empty());
}

TEST(inertia, a_broken_triangle_inequality_warns) {
  EXPECT_EQ(warnings(chain({"mass = 1\ninertia = [1, 1, 3]"})),
            (Lines{"5: link 'a': inertia is not physically possible: its largest principal moment exceeds "
                   "the sum of the "
                   "others (1, 1, 3)"}));
  EXPECT_TRUE(warnings(chain({"mass = 1\ninertia = [0, 1, 1]"})).empty());
}

TEST(movable, a_massless_end_is_refused) {
  EXPECT_EQ(errors(chain({"mass = 1\ncom = [1, 0, 0]", ""})),
            (Lines{"6: link 'b': joint 'b' moves no mass" + remedy}));
}

TEST(movable, a_model_without_masses_gets_one_sentence) {
  EXPECT_EQ(errors(chain({"", "joint = 'prismatic'", "alpha = 1"})),
            (Lines{"2: link 'a': no link has mass or inertia; give the links masses, or the joints drive "
                   "'motion'"}));
  EXPECT_TRUE(errors(chain({"drive = 'motion'", "drive = 'motion'"})).empty());
}

TEST(movable, a_massless_link_inside_the_chain_is_accepted) {
  EXPECT_TRUE(errors(chain({"", "alpha = 1\nmass = 1\ncom = [1, 0, 0]"})).empty());
}

TEST(movable, an_armature_makes_any_joint_movable) { EXPECT_TRUE(errors(chain({"armature = 0.1"})).empty()); }

TEST(movable, a_prismatic_joint_needs_mass_and_not_just_inertia) {
  EXPECT_EQ(errors(chain({"joint = 'prismatic'\ninertia = [1, 1, 1]"})),
            (Lines{"2: link 'a': joint 'a' moves no mass" + remedy}));
}

TEST(movable, a_point_mass_on_the_revolute_axis_is_refused) {
  EXPECT_EQ(
      errors(chain({"mass = 1\ncom = [0, 0, 1]"})),
      (Lines{"2: link 'a': joint 'a' moves no inertia, because all its mass lies on its own axis" + remedy}));
  EXPECT_TRUE(errors(chain({"joint = 'prismatic'\nmass = 1\ncom = [0, 0, 1]"})).empty());
}

TEST(movable, a_fixed_tool_counts_for_the_link_that_carries_it) {
  const std::string tool = "joint = 'fixed'\nalpha = 1.5707963267948966\nmass = 1\ncom = ";
  EXPECT_TRUE(errors(chain({"", tool + "[1, 0, 0]"})).empty());
  EXPECT_EQ(errors(chain({"", tool + "[0, 1, 0]"})).size(), 1u);  // on z of the carrier
}

TEST(movable, fixed_links_need_no_mass) {
  EXPECT_TRUE(errors(chain({"joint = 'fixed'", "mass = 1\ncom = [1, 0, 0]", "joint = 'fixed'"})).empty());
}

TEST(movable, a_model_of_fixed_links_is_refused) {
  EXPECT_EQ(errors(chain({"joint = 'fixed'\nmass = 1"})),
            (Lines{"2: all joints are fixed; at least one joint must move"}));
}

TEST(movable, an_unused_field_of_a_fixed_joint_warns) {
  EXPECT_EQ(warnings(chain({"mass = 1\ncom = [1, 0, 0]", "joint = 'fixed'\ndamping = 1"})),
            (Lines{"9: link 'b': damping has no effect on a fixed joint"}));
}

}  // namespace
}  // namespace redysim::test
