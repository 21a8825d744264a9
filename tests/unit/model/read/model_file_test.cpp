#include "model/read/model_file.hpp"

#include <gtest/gtest.h>

#include <clocale>

#include "unit/model/read.hpp"

namespace redysim::test {
namespace {

constexpr double pi = 3.14159265358979323846;

TEST(model_file, empty_fields_take_the_documented_defaults) {
  const Model model = read(arm);
  EXPECT_EQ(model.name, "m");
  EXPECT_EQ(model.gravity, Vec3<double>(0, 0, -9.81));
  ASSERT_EQ(model.links.size(), 1u);
  const Link& link = model.links[0];
  EXPECT_EQ(link.parent, ground);
  EXPECT_EQ(link.joint.name, "a");
  EXPECT_EQ(link.joint.type, JointType::revolute);
  EXPECT_EQ(link.joint.drive, Drive::torque);
  EXPECT_EQ(link.com, Vec3<double>(0, 0, 0));
  EXPECT_EQ(model.solver.method, SolverMethod::automatic);
  EXPECT_EQ(model.solver.rtol, 1e-6);
  EXPECT_EQ(model.solver.atol, 1e-8);
  EXPECT_TRUE(model.fmu.shows(OutputGroup::acceleration) && model.fmu.shows(OutputGroup::energy) &&
              model.fmu.shows(OutputGroup::solver));
  EXPECT_TRUE(model.fmu.tunable.empty());
}

TEST(model_file, every_link_field_is_read) {
  const Model model = read(
      "name = 'm'\ngravity = [1, 2, 3]\ndescription = 'text'\n[[link]]\nname = 'a'\nparent = 'ground'\n"
      "joint = 'prismatic'\njoint_name = 'slide'\nalpha = 1\na = 2\ntheta = 3\nd = 4\ngamma = 5\nb = 6\nmass "
      "= 7\n"
      "com = [8, 9, 10]\ninertia = [11, 12, 13, 1, 2, 3]\nq = 14\nqd = 15\nhold = true\ndamping = 16\n"
      "stiffness = 17\nrest = 18\narmature = 19\ndrive = 'free'\n");
  EXPECT_EQ(model.description, "text");
  EXPECT_EQ(model.gravity, Vec3<double>(1, 2, 3));
  const Link& link = model.links.at(0);
  const Joint& joint = link.joint;
  EXPECT_EQ(joint.type, JointType::prismatic);
  EXPECT_EQ(joint.name, "slide");
  EXPECT_EQ(joint.drive, Drive::free);
  EXPECT_EQ(joint.dh.alpha, 1);
  EXPECT_EQ(joint.dh.a, 2);
  EXPECT_EQ(joint.dh.theta, 3);
  EXPECT_EQ(joint.dh.d, 4);
  EXPECT_EQ(joint.dh.gamma, 5);
  EXPECT_EQ(joint.dh.b, 6);
  EXPECT_EQ(link.mass, 7);
  EXPECT_EQ(link.com, Vec3<double>(8, 9, 10));
  EXPECT_EQ(link.inertia, (std::array<double, 6>{11, 12, 13, 1, 2, 3}));
  EXPECT_EQ(joint.q0, 14);
  EXPECT_EQ(joint.qd0, 15);
  EXPECT_TRUE(joint.hold);
  EXPECT_EQ(joint.damping, 16);
  EXPECT_EQ(joint.stiffness, 17);
  EXPECT_EQ(joint.rest, 18);
  EXPECT_EQ(joint.armature, 19);
}

TEST(model_file, degrees_apply_to_angles_only) {
  const Model model =
      read("angle_unit = 'deg'\n" + arm +
           "alpha = 90\ntheta = 60\ngamma = -45\nq = 30\nqd = 180\nrest = 270\nstiffness = 2\n"
           "[[link]]\nname = 'b'\njoint = 'prismatic'\nmass = 1\nq = 30\nqd = 2\nrest = 3\nalpha = 180\n");
  const Joint& joint = model.links.at(0).joint;
  EXPECT_EQ(joint.dh.alpha, pi / 2);
  EXPECT_DOUBLE_EQ(joint.dh.theta, pi / 3);
  EXPECT_DOUBLE_EQ(joint.dh.gamma, -pi / 4);
  EXPECT_DOUBLE_EQ(joint.q0, pi / 6);
  EXPECT_EQ(joint.qd0, pi);
  EXPECT_EQ(joint.rest, 3 * pi / 2);
  EXPECT_EQ(joint.stiffness, 2);
  const Joint& slide = model.links.at(1).joint;
  EXPECT_EQ(slide.q0, 30);
  EXPECT_EQ(slide.qd0, 2);
  EXPECT_EQ(slide.rest, 3);
  EXPECT_EQ(slide.dh.alpha, pi);
}

TEST(model_file, a_screw_has_an_angle_and_a_pitch_in_metres_per_radian) {
  const Model model = read("angle_unit = 'deg'\n" + arm + "joint = 'screw'\npitch = -0.01\nq = 180\n");
  const Joint& joint = model.links.at(0).joint;
  EXPECT_EQ(joint.type, JointType::screw);
  EXPECT_EQ(joint.pitch, -0.01);
  EXPECT_DOUBLE_EQ(joint.q0, pi);
}

TEST(model_file, pitch_belongs_to_screws) {
  EXPECT_EQ(errors(arm + "joint = 'screw'\n"), (Lines{"2: link 'a': pitch is required for a screw joint"}));
  EXPECT_EQ(errors(arm + "joint = 'screw'\npitch = 0\n"),
            (Lines{"7: link 'a': pitch must not be 0; use joint 'revolute'"}));
  EXPECT_EQ(errors(arm + "pitch = 0.1\n"), (Lines{"6: link 'a': pitch applies to a screw joint only"}));
}

TEST(model_file, a_link_without_parent_hangs_on_the_one_listed_before) {
  const Model model = read(arms + "[[link]]\nname = 'c'\nmass = 1\nparent = 'ground'\ninertia = [1, 1, 1]\n");
  EXPECT_EQ(model.links.at(0).parent, ground);
  EXPECT_EQ(model.links.at(1).parent, 0);
  EXPECT_EQ(model.links.at(2).parent, ground);
}

std::string links(const std::vector<std::pair<std::string, std::string>>& name_and_parent) {
  std::string text = "name = 'm'\n";
  for (const auto& [name, parent] : name_and_parent)
    text += "[[link]]\nname = '" + name + "'\nparent = '" + parent + "'\nmass = 1\ninertia = [1, 1, 1]\n";
  return text;
}

TEST(model_file, links_in_any_order_come_parents_first) {
  const Model model =
      read(links({{"hand", "elbow"}, {"base", "ground"}, {"elbow", "base"}, {"other", "base"}}));
  Lines order;
  for (const Link& link : model.links) order.push_back(link.name);
  EXPECT_EQ(order, (Lines{"base", "elbow", "hand", "other"}));
  EXPECT_EQ(model.links[1].parent, 0);
  EXPECT_EQ(model.links[2].parent, 1);
  EXPECT_EQ(model.links[3].parent, 0);
}

TEST(model_file, an_order_that_is_legal_is_kept) {
  const Model model = read(links({{"a", "ground"}, {"b", "ground"}, {"c", "a"}, {"d", "b"}, {"e", "c"}}));
  std::string order;
  for (const Link& link : model.links) order += link.name;
  EXPECT_EQ(order, "abcde");
}

TEST(model_file, a_chain_of_ten_thousand_links_reads_backwards) {
  std::vector<std::pair<std::string, std::string>> chain;
  for (int i = 10000; i > 0; --i)
    chain.emplace_back("n" + std::to_string(i), i == 1 ? "ground" : "n" + std::to_string(i - 1));
  const Model model = read(links(chain));
  EXPECT_EQ(model.links.front().name, "n1");
  EXPECT_EQ(model.links.back().name, "n10000");
}

TEST(model_file, loops_and_springs_are_read) {
  const Model model =
      read(arms +
           "[[loop]]\nname = 'l'\ntype = 'fixed'\nlink_a = 'b'\nlink_b = 'ground'\npoint_a = [1, 2, 3]\n"
           "point_b = [4, 5, 6]\naxis_a = [0, 2, 0]\naxis_b = [0, 0, 3]\nx_a = [0, 1, 1]\n"
           "[[loop]]\nname = 'p'\ntype = 'point'\nlink_a = 'a'\nlink_b = 'ground'\ndirections = [[3, 0, 0], "
           "[1, 1, 0]]\n"
           "[[spring]]\nname = 's'\nlink_a = 'ground'\nlink_b = 'b'\npoint_b = [1, 0, 0]\nstiffness = "
           "10\ndamping = 2\n"
           "rest_length = 0.5\n");
  const Loop& loop = model.loops.at(0);
  EXPECT_EQ(loop.type, LoopType::fixed);
  EXPECT_EQ(loop.link_a, 1);
  EXPECT_EQ(loop.link_b, ground);
  EXPECT_EQ(loop.point_a, Vec3<double>(1, 2, 3));
  EXPECT_EQ(loop.point_b, Vec3<double>(4, 5, 6));
  EXPECT_EQ(loop.axis_a, Vec3<double>(0, 1, 0));
  EXPECT_EQ(loop.axis_b, Vec3<double>(0, 0, 1));
  EXPECT_NEAR((loop.x_a - Vec3<double>(0, 0, 1)).norm(), 0, 1e-15);
  EXPECT_EQ(loop.x_b, Vec3<double>(1, 0, 0));
  const Loop& point = model.loops.at(1);
  ASSERT_EQ(point.directions.size(), 2u);
  EXPECT_EQ(point.directions[0], Vec3<double>(1, 0, 0));
  EXPECT_NEAR(point.directions[1].norm(), 1, 1e-15);
  const SpringDamper& spring = model.springs.at(0);
  EXPECT_EQ(spring.name, "s");
  EXPECT_EQ(spring.link_a, ground);
  EXPECT_EQ(spring.link_b, 1);
  EXPECT_EQ(spring.stiffness, 10);
  EXPECT_EQ(spring.damping, 2);
  EXPECT_EQ(spring.rest_length, 0.5);
}

TEST(model_file, an_unused_second_direction_is_perpendicular_to_the_axis) {
  const Model model = read(arms +
                           "[[loop]]\nname = 'l'\ntype = 'revolute'\nlink_a = 'b'\nlink_b = 'ground'\n"
                           "axis_a = [1, 0, 0]\naxis_b = [1, 0, 0]\n");
  EXPECT_NEAR(model.loops.at(0).x_a.dot(model.loops.at(0).axis_a), 0, 1e-15);
  EXPECT_NEAR(model.loops.at(0).x_b.norm(), 1, 1e-15);
}

TEST(model_file, settings_are_read) {
  const Model model =
      read(arm +
           "[solver]\nmethod = 'bdf'\nrtol = 1e-4\nmax_step = 0.5\n[fmu]\noutputs = ['energy']\n"
           "tunable = ['a.mass', 'a.inertia[6]', 'a.damping', 'gravity[3]']\nstop_time = 3\n"
           "step_size = 0.25\nauthor = 'A. & B.'\nversion = '2.1'\n");
  EXPECT_EQ(model.solver.method, SolverMethod::bdf);
  EXPECT_EQ(model.solver.rtol, 1e-4);
  EXPECT_EQ(model.solver.atol, 1e-6);
  EXPECT_EQ(model.solver.max_step, 0.5);
  EXPECT_FALSE(model.fmu.shows(OutputGroup::acceleration));
  EXPECT_TRUE(model.fmu.shows(OutputGroup::energy));
  EXPECT_FALSE(model.fmu.shows(OutputGroup::solver));
  EXPECT_EQ(model.fmu.tunable, (Lines{"a.mass", "a.inertia[6]", "a.damping", "gravity[3]"}));
  EXPECT_EQ(model.fmu.stop_time, 3);
  EXPECT_EQ(model.fmu.step_size, 0.25);
  EXPECT_EQ(errors(arm + "[fmu]\nauthor = 3\n"), (Lines{"7: fmu: author must be a string, got a number"}));
  EXPECT_EQ(model.fmu.origin, (Lines{"2.1", "A. & B.", "", ""}));
}

TEST(model_file, numbers_do_not_depend_on_the_locale) {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  for (const char* locale : {"de_DE.UTF-8", "fr_FR.UTF-8"})
    if (std::setlocale(LC_ALL, locale)) break;
  EXPECT_EQ(read(arm + "q = 0.5\n").links.at(0).joint.q0, 0.5);
  EXPECT_EQ(errors(arm + "damping = -0.5\n"), (Lines{"6: link 'a': damping must be >= 0, got -0.5"}));
  std::setlocale(LC_ALL, before.c_str());
}

TEST(model_file, the_source_is_kept_byte_for_byte) {
  const std::string text = arm + "# caf\xc3\xa9\r\n";
  EXPECT_EQ(read_model_text(text, "m.toml").source, text);
}

TEST(model_file, a_given_rtol_settles_the_target_error) {
  const auto target = [](const std::string& solver) {
    return read(arm + "[solver]\ntarget_error = 1e-6\n" + solver).solver.target_error;
  };
  EXPECT_EQ(target(""), 1e-6);
  EXPECT_EQ(target("rtol = 1e-3\n"), 0);
}

}  // namespace
}  // namespace redysim::test
