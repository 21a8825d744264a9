#include "dynamics/assembly/freedom.hpp"

#include <gtest/gtest.h>

#include "fmi/boundary/assembly_messages.hpp"
#include "model/read/model_file.hpp"
#include "support/mechanisms.hpp"

namespace redysim {
namespace {

// Two parallelogram four-bars, one on the other: two degrees of freedom, redundant spatial rows.
struct Chain {
  Model model = test::four_bar_chain(2);
  std::vector<double> q = {0.7, 0.7, -0.7, 0.4, 0.4, -0.4};

  Freedom with(const std::vector<int>& motions) {
    for (Link& link : model.links) link.joint.drive = Drive::free;
    for (int i : motions) model.links[i].joint.drive = Drive::motion;
    return freedom(model, Plan<double>(model), q.data());
  }
};

TEST(freedom, of_a_fully_driven_system) {
  Chain chain;
  const Freedom found = chain.with({0, 3});
  EXPECT_EQ(found.system, 2);
  EXPECT_EQ(found.left, 0);
  EXPECT_EQ(found.surplus, 0);
  EXPECT_EQ(sentence(found), "2 motions for 2 degrees of freedom: fully driven");
}

TEST(freedom, that_motions_leave_is_integrated) {
  EXPECT_EQ(sentence(Chain().with({4})),
            "1 motion for 2 degrees of freedom: 1 is not prescribed and is integrated");
}

TEST(freedom, that_motions_outnumber) {
  EXPECT_EQ(sentence(Chain().with({0, 1, 3})),
            "3 motions for 2 degrees of freedom: 1 motion more than degrees of freedom, they must be "
            "consistent with the loops");
  EXPECT_EQ(sentence(Chain().with({0, 1})),
            "2 motions for 2 degrees of freedom: 1 motion more than degrees of freedom, they must be "
            "consistent with the loops; 1 is "
            "not prescribed and is integrated");
}

TEST(freedom, locked_joints_count_as_motions) {
  Chain chain;
  chain.with({0});
  chain.model.links[3].joint.drive = Drive::locked;
  EXPECT_EQ(freedom(chain.model, Plan<double>(chain.model), chain.q.data()).left, 0);
}

TEST(freedom, a_spherical_joint_has_three) {
  // a rod on a spherical joint whose tip slides along x and y of the ground
  const Model model = read_model_text(
                          "name = 'm'\n[[link]]\nname = 'a'\njoint = 'spherical'\nmass = 1\n"
                          "inertia = [1, 1, 1]\n[[link]]\nname = 'b'\njoint = 'prismatic'\nmass = 1\n"
                          "drive = 'motion'\n[[loop]]\nname = 'l'\ntype = 'point'\nlink_a = 'b'\nlink_b = "
                          "'ground'\npoint_a = [0, 0, 1]\ndirections = [[1, 0, 0]]\n",
                          "m.toml")
                          .model;
  const std::vector<double> q(5, 0.0);
  const Freedom found = freedom(model, Plan<double>(model), q.data());
  EXPECT_EQ(found.motions, 1);
  EXPECT_EQ(found.system, 3);
  EXPECT_EQ(found.left, 2);
}

TEST(freedom, of_all_joints_prescribed_has_nothing_left) {
  const Freedom found = Chain().with({0, 1, 2, 3, 4, 5});
  EXPECT_EQ(found.left, 0);
  EXPECT_EQ(found.surplus, 4);
}

}  // namespace
}  // namespace redysim
