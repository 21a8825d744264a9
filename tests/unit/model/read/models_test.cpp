#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "unit/model/read.hpp"

// The model files that come with the project. Expected numbers are typed from the sources that each file
// names.

namespace redysim::test {
namespace {

Model shipped(const std::string& name) {
  return read_model_file(std::string(REDYSIM_MODELS) + "/" + name + ".toml").model;
}

constexpr double pi = 3.14159265358979323846;

TEST(models, every_shipped_file_reads_without_a_warning_and_is_named_after_its_model) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(REDYSIM_MODELS)) {
    if (entry.path().extension() != ".toml") continue;
    ++count;
    const ModelFile file = read_model_file(entry.path().string());
    EXPECT_TRUE(file.warnings.empty()) << entry.path();
    EXPECT_EQ(file.model.name, entry.path().stem().string());
    EXPECT_FALSE(file.model.description.empty()) << entry.path();
  }
  EXPECT_GE(count, 12);
}

TEST(models, kuka_kr5_has_the_published_data) {
  const Model model = shipped("kuka_kr5");
  ASSERT_EQ(model.links.size(), 6u);
  const double alpha[] = {0, pi / 2, 0, pi / 2, -pi / 2, pi / 2};
  const double a[] = {0, 0.18, 0.6, 0.12, 0, 0};
  const double d[] = {0.4, 0, 0, 0.62, 0, 0};
  const double mass[] = {16.038, 7.988, 12.973, 2.051, 0.811, 0.008};
  const double com[][3] = {{0.104667, 0.005077, 0.059035},  {0.267012, 0, 0},
                           {0.087677, -0.034263, 0.007779}, {-3.3e-05, 0.007634, -0.109372},
                           {0, 0.032618, -0.009789},        {0, 0, 0.111885}};
  const double inertia[][3] = {
      {0.176938765, 0.266532371, 0.262222375}, {0.271640468, 0.276878849, 0.021894253},
      {0.388988085, 0.376583684, 0.10414629},  {0.004767354, 0.010122217, 0.01210886},
      {0.000760688, 0.001783961, 0.001801078}, {3.113e-06, 1.512e-06, 1.652e-06}};
  for (int i = 0; i < 6; ++i) {
    const Link& link = model.links[i];
    EXPECT_EQ(link.name, "link" + std::to_string(i + 1));
    EXPECT_EQ(link.joint.name, "joint" + std::to_string(i + 1));
    EXPECT_EQ(link.parent, i - 1);
    EXPECT_EQ(link.joint.dh.alpha, alpha[i]);
    EXPECT_EQ(link.joint.dh.a, a[i]);
    EXPECT_EQ(link.joint.dh.d, d[i]);
    EXPECT_EQ(link.joint.q0, 0);
    EXPECT_EQ(link.mass, mass[i]);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(link.com[k], com[i][k]);
      EXPECT_EQ(link.inertia[k], inertia[i][k]);
      EXPECT_EQ(link.inertia[k + 3], 0);
    }
  }
}

TEST(models, the_two_grippers_differ_in_where_link_4_sits) {
  const Model paper = shipped("gripper"), file = shipped("gripper_redysim");
  EXPECT_EQ(paper.links.at(3).joint.dh.a, 0.1);
  EXPECT_EQ(file.links.at(3).joint.dh.a, 0.05);
  for (const Model& model : {paper, file}) {
    EXPECT_EQ(model.links.at(3).parent, 0);
    EXPECT_EQ(model.links.at(3).joint.q0, pi / 2);
    EXPECT_EQ(model.gravity, Vec3<double>(0, -9.81, 0));
  }
}

TEST(models, four_bar_starts_closed) {
  const Model model = shipped("four_bar");
  const double q2 = model.links.at(1).joint.q0, q23 = q2 + model.links.at(2).joint.q0;
  const Loop& loop = model.loops.at(0);
  EXPECT_EQ(loop.type, LoopType::point);
  EXPECT_EQ(loop.link_a, 0);
  EXPECT_EQ(loop.link_b, 2);
  EXPECT_EQ(loop.directions.size(), 2u);
  EXPECT_EQ(model.links[0].joint.q0, 0);
  EXPECT_NEAR(0.15 + 0.13 * std::cos(q2) + loop.point_b.x() * std::cos(q23), loop.point_a.x(), 1e-15);
  EXPECT_NEAR(0.13 * std::sin(q2) + loop.point_b.x() * std::sin(q23), 0, 1e-15);
}

TEST(models, prismatic_starts_are_lengths) {
  EXPECT_EQ(shipped("rp_robot").links.at(1).joint.q0, 0.15);
  EXPECT_EQ(shipped("rp_robot").links.at(1).joint.type, JointType::prismatic);
  const Model gantry = shipped("pppr");
  for (int i = 0; i < 3; ++i) EXPECT_EQ(gantry.links.at(i).joint.q0, 0.05);
  EXPECT_EQ(gantry.links.at(2).joint.dh.theta, pi / 2);
  EXPECT_EQ(gantry.links.at(3).joint.type, JointType::revolute);
}

TEST(models, long_chain_has_twenty_equal_links) {
  const Model model = shipped("long_chain");
  ASSERT_EQ(model.links.size(), 20u);
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(model.links[i].parent, i - 1);
    EXPECT_EQ(model.links[i].joint.dh.a, 0.03);
    EXPECT_EQ(model.links[i].mass, 0.05);
  }
}

TEST(models, scara_has_a_lift_and_a_fixed_tool) {
  const Model model = shipped("scara");
  EXPECT_EQ(model.links.at(2).joint.type, JointType::prismatic);
  EXPECT_EQ(model.links.at(4).joint.type, JointType::fixed);
}

}  // namespace
}  // namespace redysim::test
