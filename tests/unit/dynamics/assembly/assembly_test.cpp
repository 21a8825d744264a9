#include "dynamics/assembly/assembly.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fmi/boundary/assembly_messages.hpp"
#include "model/read/model_file.hpp"
#include "support/mechanisms.hpp"

namespace redysim {
namespace {

constexpr double degree = 0.017453292519943295;

struct Start {
  Model model;
  Plan<double> plan;
  Workspace<double> ws;
  std::vector<double> q, qd;
  Assembly result;

  explicit Start(Model given, std::vector<double> q0 = {}, std::vector<double> qd0 = {})
      : Start(given, Plan<double>(given), std::move(q0), std::move(qd0)) {}
  Start(Model given, Plan<double> of_model, std::vector<double> q0, std::vector<double> qd0)
      : model(std::move(given)), plan(std::move(of_model)), ws(plan), q(std::move(q0)), qd(std::move(qd0)) {
    for (std::size_t i = q.size(); i < plan.joints.size(); ++i)
      q.push_back(model.links[plan.joints[i].link].joint.q0);
    qd.resize(plan.joints.size(), 0.0);
    result = assemble(model, plan, ws, q.data(), qd.data());
  }
};

Model four_bar() { return read_model_file(REDYSIM_MODELS "/four_bar.toml").model; }

TEST(Assembly, leaves_a_closed_pose_alone) {
  const Start start(four_bar());
  EXPECT_TRUE(start.result.closed);
  EXPECT_EQ(start.q[1], start.model.links[1].joint.q0);
  EXPECT_TRUE(corrections(start.model, start.plan, start.result).empty());
}

TEST(Assembly, closes_the_four_bar_whose_start_pose_is_open_by_26_mm) {
  const Start start(four_bar(), {0, 145.54 * degree, 130.54 * degree});
  ASSERT_TRUE(start.result.closed);
  // closed form: crank at 0 leaves a triangle of 0.10, 0.13 and 0.10 m
  const double closed = std::acos(-0.65);
  EXPECT_NEAR(start.result.gap_before.size, std::hypot(0.00340, 0.02588), 2e-5);
  EXPECT_EQ(start.q[0], 0);
  EXPECT_NEAR(start.q[1], closed, 1e-13);
  EXPECT_NEAR(start.q[2], closed, 1e-13);
  EXPECT_LT(start.result.gap.size, 1e-15);
  EXPECT_NEAR(start.result.moved[1], closed - 145.54 * degree, 1e-13);
  EXPECT_EQ(
      corrections(start.model, start.plan, start.result),
      std::vector<std::string>{"initial configuration violates the loop constraints by 26.1 mm; corrected: "
                               "joint2 by -0.262 rad, joint3 by 2.8e-05 rad"});
}

TEST(Assembly, finds_the_nearest_pose_when_nothing_is_held) {
  Model model = four_bar();
  model.links[0].joint.hold = false;
  const std::vector<double> q0 = {0.1, 2.4, 2.2};
  const Start start(model, q0);
  ASSERT_TRUE(start.result.closed);
  // nearest along the one-parameter family of closed poses: neighbours found by holding the crank aside
  auto distance = [&q0](const std::vector<double>& q) {
    return std::hypot(q[0] - q0[0], q[1] - q0[1], q[2] - q0[2]);
  };
  for (double aside : {-1e-3, 1e-3}) {
    model.links[0].joint.hold = true;
    const Start neighbour(model, {start.q[0] + aside, start.q[1], start.q[2]});
    ASSERT_TRUE(neighbour.result.closed);
    EXPECT_GT(distance(neighbour.q), distance(start.q));
  }
}

TEST(Assembly, makes_velocities_consistent_and_keeps_those_of_held_joints) {
  const Start start(four_bar(), {}, {3.0, 0, 0});
  ASSERT_TRUE(start.result.consistent);
  EXPECT_EQ(start.qd[0], 3.0);
  // instant centres: crank tip moves at 0.15 m/s perpendicular to the base line, see the derivative of the
  // closure
  const double h = 1e-6;
  const Start later(four_bar(), {3 * h, start.q[1], start.q[2]});
  const Start sooner(four_bar(), {-3 * h, start.q[1], start.q[2]});
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(start.qd[i], (later.q[i] - sooner.q[i]) / (2 * h), 1e-7);
  const std::vector<std::string> said = corrections(start.model, start.plan, start.result);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_EQ(
      said[0].rfind("initial velocities violate the loop constraints by 0.15 m/s; corrected: joint2 by ", 0),
      0u)
      << said[0];
}

// Crank and rocker both held: 0.15 m/s of the crank's tip have nowhere to go.
TEST(Assembly, says_which_velocities_no_motion_has) {
  Model model = four_bar();
  for (Link& link : model.links) link.joint.hold = true;
  const Start start(model, {}, {3.0, 0, 0});
  EXPECT_FALSE(start.result.consistent);
  EXPECT_EQ(
      failure(model, start.result),
      "loop 'closure': no velocities satisfy the loop constraints while held and prescribed joints keep "
      "theirs; smallest residual 0.15 m/s");
}

// A ball that turns about its own origin is closed to a bracket, whose frame lies 10 000 times as far away as
// the ball: the levers of the rows are rounding errors of this distance.
TEST(Assembly, keeps_velocities_that_no_loop_restricts) {
  Model model = read_model_text(R"(
name = "seat"
gravity = [0, 0, -9.81]
[[link]]
name = "arm"
mass = 1
inertia = [1, 1, 1]
[[link]]
name = "bracket"
joint = "fixed"
alpha = 0.7
a = 0.51
theta = 0.4
d = 0.3
[[link]]
name = "ball"
parent = "arm"
joint = "spherical"
a = 5e-5
qd = [290, -120, 110]
mass = 1e-11
inertia = [5e-20, 5e-20, 5e-20]
[[loop]]
name = "seat"
type = "spherical"
link_a = "ball"
link_b = "bracket"
)",
                                "seat")
                    .model;
  for (int k = 0; k < 10; ++k) {
    DhParameters& dh = model.links[1].joint.dh;
    dh.theta = 0.1 + 0.6 * k;
    const Pose bracket = pose_of(dh);
    model.loops[0].point_b = bracket.rotation.transpose() * (Vec3<double>(5e-5, 0, 0) - bracket.position);
    const Start start(model, {}, {0, 290, -120, 110});
    EXPECT_EQ(corrections(start.model, start.plan, start.result), std::vector<std::string>());
  }
}

// (q - q0) + J^T lambda = 0 and phi = 0, to rounding.
TEST(Assembly, ends_at_the_nearest_pose_to_rounding) {
  Model model = four_bar();
  model.links[0].joint.hold = false;
  const std::vector<double> q0 = {0.1, 2.6, 2.0};
  const Start start(model, q0);
  ASSERT_TRUE(start.result.closed);
  // tangent of the closed poses: the velocities that the loop lets pass
  const Start moving(model, start.q, {1, 0, 0});
  double along = 0, length = 0;
  for (int i = 0; i < 3; ++i) {
    along += (start.q[i] - q0[i]) * moving.qd[i];
    length += moving.qd[i] * moving.qd[i];
  }
  EXPECT_LT(std::abs(along) / std::sqrt(length), 1e-11);
}

// A flat parallelogram goes on parallel, (1, 1, -1), or crossed: r psi' (r - l) = r theta' (r + l) with bars
// of r = 0.2 m and l = 0.3 m gives (1, -5, -5). Other velocities that its dependent rows allow are no
// motions.
TEST(Assembly, starts_a_singular_pose_on_one_of_its_branches) {
  Model model = test::four_bar_chain(1);
  model.links[0].joint.hold = true;
  const std::vector<double> flat(3, 0.0);
  const auto expect_velocity = [](const Start& start, double crank, double rocker, double coupler,
                                  double tolerance = 1e-9) {
    ASSERT_TRUE(start.result.closed && start.result.consistent);
    const double wanted[] = {crank, rocker, coupler};
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(start.qd[i], wanted[i], tolerance * std::abs(crank));
  };
  expect_velocity(Start(model, flat, {2.0, 2.0, -2.0}), 2, 2, -2);
  expect_velocity(Start(model, flat, {2.0, -10.0, -10.0}), 2, -10, -10);
  expect_velocity(Start(model, flat, {1000.0, 2.0, -2.0}), 1000, 1000, -1000);
  expect_velocity(Start(model, flat, {2.0, -9.0, -11.0}), 2, -10, -10);
  // the same far away: bars differ by 1e-10 m, and positions from the ground's origin carry that rounding
  for (const double far : {1e6, 2466390.0}) {
    SCOPED_TRACE(far);
    Model away = model;
    away.links[0].joint.dh.a += far;
    away.links[1].joint.dh.a += far;
    Plan<double> seen_from_origin(away);
    seen_from_origin.origin.setZero();
    for (const Plan<double>& plan : {Plan<double>(away), seen_from_origin}) {
      expect_velocity(Start(away, plan, flat, {1000.0, 2.0, -2.0}), 1000, 1000, -1000, 1e-8);
      expect_velocity(Start(away, plan, flat, {2.0, -9.0, -11.0}), 2, -10, -10, 1e-8);
    }
  }
}

TEST(Assembly, says_what_remains_open_of_an_impossible_loop) {
  Model model = four_bar();
  model.loops[0].point_b = {0.4, 0, 0};
  const Start start(model);
  EXPECT_FALSE(start.result.closed);
  EXPECT_EQ(start.q[1], model.links[1].joint.q0);
  // coupler 0.4 m: at its shortest it reaches 0.4 - 0.13 m from the rocker's pivot, the crank tip at 0 is
  // 0.1 m away from that
  EXPECT_EQ(failure(start.model, start.result),
            "loop 'closure': no configuration satisfies the loop constraints; smallest residual 0.17 m");
}

TEST(Assembly, sees_that_a_planar_loop_is_offset_along_its_axis) {
  Model model = four_bar();
  model.loops[0].type = LoopType::revolute;
  EXPECT_TRUE(Start(model).result.closed);
  model.loops[0].point_a.z() = 0.003;
  EXPECT_EQ(failure(model, Start(model).result),
            "loop 'closure': no configuration satisfies the loop constraints; smallest residual 3 mm");
}

TEST(Assembly, asks_for_digits_if_axes_are_parallel_but_for_rounding) {
  for (const LoopType type : {LoopType::revolute, LoopType::spherical}) {
    Model model = four_bar();
    model.loops[0].type = type;
    model.links[2].joint.dh.alpha += 4e-6;
    const std::string message = failure(model, Start(model).result);
    EXPECT_NE(message.find(": do angles or lengths lack digits?"), std::string::npos) << message;
  }
}

TEST(Assembly, closes_a_parallelogram_that_starts_flat) {
  const Model model = test::four_bar_chain(3);
  const std::vector<double> flat(9, 0.0);
  const Start exact(model, flat);
  EXPECT_TRUE(exact.result.closed);
  EXPECT_EQ(exact.q, flat);
  std::vector<double> bent = flat;
  for (std::size_t i = 0; i < bent.size(); ++i) bent[i] = 1e-3 * std::sin(1.0 + static_cast<double>(i));
  const Start near(model, bent);
  EXPECT_TRUE(near.result.closed);
  for (std::size_t i = 0; i < bent.size(); ++i) EXPECT_NEAR(near.q[i], bent[i], 3e-3);
}

TEST(Assembly, folds_a_flat_pose_that_is_too_long) {
  // crank and coupler on one line overshoot the rocker's tip: no joint alone shortens them
  Model model = test::four_bar_chain(1);
  model.loops[0].point_b = {0.29, 0, 0};
  const Start start(model, {0, 0, 0});
  EXPECT_TRUE(start.result.closed);
  EXPECT_LT(start.result.gap.size, 1e-11);
}

TEST(Assembly, closes_redundant_loops) {
  Model model = test::four_bar_chain(1, LoopType::spherical);
  model.loops.push_back(model.loops[0]);
  model.loops[1].name = "again";
  const Start start(model, {0.7, 0.8, -0.6});
  ASSERT_TRUE(start.result.closed);
  EXPECT_NEAR(start.q[0], start.q[1], 1e-12);
  EXPECT_NEAR(start.q[2], -start.q[1], 1e-12);
}

TEST(Assembly, closes_long_chains_of_loops) {
  const int n = 40;
  std::vector<double> q = test::four_bar_chain_pose(n, [](int k) { return 1 + 0.1 * std::sin(k); });
  for (std::size_t i = 0; i < q.size(); ++i) q[i] += 0.05 * std::cos(static_cast<double>(i));
  const Start start(test::four_bar_chain(n), q);
  EXPECT_TRUE(start.result.closed);
  EXPECT_LT(start.result.gap.size, 1e-14);
}

}  // namespace
}  // namespace redysim
