#include "dynamics/assembly/movability.hpp"

#include <gtest/gtest.h>

#include "fmi/boundary/assembly_messages.hpp"
#include "unit/model/read.hpp"

// Which joints move nothing, in scenes whose single joints all carry mass.

namespace redysim::test {
namespace {

// A body with mass and inertia.
std::string body(const std::string& name, const std::string& parent, const std::string& fields) {
  return "[[link]]\nname = '" + name + "'\nparent = '" + parent +
         "'\nmass = 1\ncom = [0.1, 0.2, 0.3]\ninertia = [1, 1.1, 1.2]\n" + fields;
}

std::string massless(const std::string& name, const std::string& parent, const std::string& fields) {
  return "[[link]]\nname = '" + name + "'\nparent = '" + parent + "'\n" + fields;
}

// The sentence of a scene that is singular at all poses; empty for one that is not.
std::string found(const std::string& links) {
  const Model model = read("name = 'm'\n" + links);
  const Plan<double> plan(model);
  Workspace<double> workspace(plan);
  const int joint = always_singular_joint(plan, workspace);
  return joint < 0 ? "" : singular_sentence(model, plan, joint, "");
}

const std::string tilted = "alpha = 0.7\na = 0.3\ntheta = 0.4\nd = 0.2\n";

TEST(movability, one_joint_on_a_massless_floating_base_turns_with_it) {
  for (const char* child : {"revolute", "prismatic", "spherical", "universal"})
    EXPECT_NE(found(massless("base", "ground", "joint = 'free'\n") +
                    body("arm", "base", tilted + "joint = '" + child + "'\n")),
              "")
        << child;
  EXPECT_EQ(found(massless("base", "ground", "joint = 'free'\n") +
                  body("hand", "base", tilted + "joint = 'fixed'\n")),
            "");
  // two arms about axes that are not parallel hold it
  EXPECT_EQ(found(massless("base", "ground", "joint = 'free'\n") + body("left", "base", tilted) +
                  body("right", "base", "alpha = -0.5\na = -0.3\n")),
            "");
}

TEST(movability, a_ball_turns_freely_about_a_line_of_mass) {
  for (const char* com : {"[0, 0, 1]", "[1, 0, 0]", "[0.3, -0.4, 0.5]"})
    EXPECT_EQ(
        found(massless("bob", "ground", tilted + "joint = 'spherical'\nmass = 2\ncom = " + com + "\n")),
        "joint 'bob': the mass matrix is singular, because this joint and those it carries can move without "
        "moving mass or inertia; give its link mass or inertia");
  EXPECT_NE(found(massless("rod", "ground",
                           "joint = 'spherical'\nmass = 2\ncom = [1, 0, 0]\ninertia = [0, 1, 1]\n")),
            "");
  EXPECT_EQ(found(massless("rod", "ground",
                           "joint = 'spherical'\nmass = 2\ncom = [1, 0, 0]\ninertia = [1e-6, 1, 1]\n")),
            "");
}

TEST(movability, parallel_joints_with_a_massless_link_between) {
  const std::string skew = massless("foot", "ground", tilted);
  EXPECT_NE(found(skew + massless("a", "foot", tilted) + body("b", "a", "d = 0.5\n")), "");
  EXPECT_NE(found(skew + massless("a", "foot", tilted + "joint = 'prismatic'\n") +
                  body("b", "a", "a = 0.5\njoint = 'prismatic'\n")),
            "");
  EXPECT_EQ(found(massless("a", "ground", tilted) + body("b", "a", "a = 0.5\n")), "");
  EXPECT_EQ(found(massless("a", "ground", tilted + "armature = 0.01\n") + body("b", "a", "d = 0.5\n")), "");
  EXPECT_EQ(found(massless("a", "ground", tilted + "drive = 'motion'\n") + body("b", "a", "d = 0.5\n")), "");
}

TEST(movability, light_links_and_long_chains_move) {
  std::string chain;
  for (int i = 0; i < 1000; ++i)
    chain += body("l" + std::to_string(i), i == 0 ? "ground" : "l" + std::to_string(i - 1),
                  "a = 1\nalpha = 0.3\n");
  EXPECT_EQ(found(chain), "");
  EXPECT_EQ(found(massless("a", "ground", tilted + "mass = 1e-7\ncom = [0.1, 0, 0]\n") +
                  body("b", "a", "d = 0.5\n")),
            "");
}

TEST(movability, a_singular_start_is_told_from_a_singular_scene) {
  // a wrist of massless links, stretched
  const Model model =
      read("name = 'm'\n" + massless("a", "ground", "") + massless("b", "a", "alpha = 1.5707963267948966\n") +
           body("c", "b", "alpha = -1.5707963267948966\n"));
  const Plan<double> plan(model);
  Workspace<double> workspace(plan);
  const double stretched[] = {0.3, 0, 0.4}, bent[] = {0.3, 0.5, 0.4};
  EXPECT_GE(singular_joint(plan, workspace, stretched), 0);
  EXPECT_EQ(singular_joint(plan, workspace, bent), -1);
  EXPECT_EQ(always_singular_joint(plan, workspace), -1);
}

}  // namespace
}  // namespace redysim::test
