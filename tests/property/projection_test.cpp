#include <gtest/gtest.h>

#include "integrate/system/system.hpp"
#include "support/mechanisms.hpp"
#include "support/random_loops.hpp"

namespace redysim {
namespace {

using test::Vector;

// A state at `distance` from a configuration that satisfies the constraints, with velocities that violate
// them.
std::vector<double> open_state(const System& system, const Vector& closed, double distance,
                               test::Random& random) {
  std::vector<double> y(static_cast<std::size_t>(system.size()), 0.0);
  for (Eigen::Index i = 0; i < closed.size(); ++i) {
    y[i] = closed[i] + random.between(-distance, distance);
    y[closed.size() + i] = random.between(-1, 1);
  }
  return y;
}

// The projections, in the mass metric and within a step, correct position and velocity.
void expect_projection_closes(const Model& model, const Vector& closed, double distance,
                              test::Random& random) {
  const Plan<double> plan(model);
  System system(plan, true);
  const std::vector<double> open = open_state(system, closed, distance, random);
  for (const bool within_step : {false, true}) {
    std::vector<double> y = open;
    ASSERT_TRUE(within_step ? system.close_within_step(0, y.data())
                            : system.project(0, y.data(), nullptr) == Status::ok);
    test::Evaluate<double> tree(model);
    const Vector q = Eigen::Map<Vector>(y.data(), plan.nv),
                 qd = Eigen::Map<Vector>(y.data() + plan.nv, plan.nv);
    EXPECT_LT(tree.residual(q, qd).lpNorm<Eigen::Infinity>(), 1e-12);
    EXPECT_LT(tree.rate(q, qd).lpNorm<Eigen::Infinity>(), 1e-11);
    EXPECT_LT((q - closed).lpNorm<Eigen::Infinity>(), 100 * distance);
  }
}

class Projection : public testing::TestWithParam<unsigned> {
 protected:
  test::Random random{GetParam()};
};
INSTANTIATE_TEST_SUITE_P(Seed, Projection, testing::Range(0u, 20u));

TEST_P(Projection, closes_a_chain_of_four_bars) {
  const auto angle = [this](int k) {
    return 0.9 + 0.03 * static_cast<double>(GetParam()) + 0.1 * std::sin(7.0 * k);
  };
  for (int count : {1, 3, 12})
    expect_projection_closes(test::four_bar_chain(count),
                             test::vector_of(test::four_bar_chain_pose(count, angle)), 1e-4, random);
}

TEST_P(Projection, closes_a_spatial_loop_on_a_moving_root) {
  Model model = test::serial_chain(9, false);
  const Vector q = test::vector_of(random.numbers(9, 1));
  model.loops.push_back(test::closed_loop(random, LoopType::universal, 1, 8, test::poses_at(model, q)));
  expect_projection_closes(model, q, 1e-4, random);
}

// delta = U^2 J^T lambda, U: the units of the joints, with J from differences of the residuals.
TEST_P(Projection, moves_the_joints_least_within_a_step) {
  Model model = test::serial_chain(9, false);
  const Vector closed = test::vector_of(random.numbers(9, 1));
  model.loops.push_back(test::closed_loop(random, LoopType::universal, 1, 8, test::poses_at(model, closed)));
  const Plan<double> plan(model);
  System system(plan, true);
  std::vector<double> y = open_state(system, closed, 1e-6, random);
  const std::vector<double> open = y;
  ASSERT_TRUE(system.close_within_step(0, y.data()));
  const Vector unit = test::vector_of(plan.joint_units);
  const auto J = test::loop_jacobian(model, Eigen::Map<Vector>(y.data(), 9));
  const test::Matrix scaled = unit.asDiagonal() * J.transpose();
  for (const int part : {0, 9}) {  // q, qd
    const Vector change = Eigen::Map<const Vector>(&y[part], 9) - Eigen::Map<const Vector>(&open[part], 9);
    const Vector in_units = change.cwiseQuotient(unit);
    const Vector lambda = (scaled.transpose() * scaled).ldlt().solve(scaled.transpose() * in_units);
    EXPECT_LT((in_units - scaled * lambda).norm(), 1e-4 * in_units.norm());
    EXPECT_GT(in_units.norm(), 1e-7);
  }
}

TEST_P(Projection, closes_overlapping_loops) {
  expect_projection_closes(test::overlapping_loops(5), test::vector_of(test::overlapping_loops_pose(5)), 1e-4,
                           random);
}

// Rockers of next to no mass, next to the flat position where the loop's two rows become one.
TEST_P(Projection, closes_near_massless_links_near_singular_poses) {
  const auto angle = [this](int k) { return 0.003 * (1 + static_cast<double>(GetParam())) + 0.001 * k; };
  for (double factor : {1e-6, 1e-9, 1e-12}) {
    Model model = test::four_bar_chain(3);
    for (std::size_t k = 1; k < model.links.size(); k += 2) {
      model.links[k].mass *= factor;
      for (double& entry : model.links[k].inertia) entry *= factor;
    }
    expect_projection_closes(model, test::vector_of(test::four_bar_chain_pose(3, angle)), 1e-7, random);
  }
}

// Each loop is closed to the rounding of its own lengths and speeds, whatever stands beside it.
TEST_P(Projection, closes_a_small_loop_beside_a_large_one) {
  const double size = 1e-5;
  Model model = test::four_bar_chain(1);
  for (Link link : test::resized(model, size).links) {
    link.name = "small_" + link.name;
    link.joint.name = "small_" + link.joint.name;
    if (link.parent != ground) link.parent += 3;
    model.links.push_back(link);
  }
  Loop small = test::resized(test::four_bar_chain(1), size).loops[0];
  small.name = "small";
  small.link_a += 3;
  small.link_b += 3;
  model.loops.push_back(small);
  const Plan<double> plan(model);
  System system(plan, true);
  std::vector<double> y(static_cast<std::size_t>(system.size()), 0.0);
  for (int k = 0; k < 6; ++k) {
    y[k] = (k % 3 == 2 ? -1.1 : 1.1) * (1 + 1e-11 * random.between(-1, 1));
    y[6 + k] = (k % 3 == 2 ? -30 : 30) * (1 + 1e-11 * random.between(-1, 1)) * (k < 3 ? 0.1 : 1);
  }
  ASSERT_EQ(system.project(0, y.data(), nullptr), Status::ok);
  test::Evaluate<double> tree(model);
  const Vector q = Eigen::Map<Vector>(y.data(), 6), qd = Eigen::Map<Vector>(y.data() + 6, 6);
  EXPECT_LT(tree.residual(q, qd).tail(2).lpNorm<Eigen::Infinity>(), 1e-14 * size);
  EXPECT_LT(tree.rate(q, qd).tail(2).lpNorm<Eigen::Infinity>(), 1e-14 * 30 * size);
}

// Two coaxial joints turn against each other below a link that a loop guides without rotation: all speeds at
// the loop's ends are rounding, and must not end the corrections of the other loop.
TEST_P(Projection, closes_a_loop_beside_one_whose_ends_stand_still) {
  Model model = test::four_bar_chain(1);
  model.links.push_back(test::rod("out", ground, 0.2, 0.5));
  model.links.push_back(test::rod("back", 3, 0.2, 0.5));
  Loop guided;
  guided.name = "guided";
  guided.type = LoopType::prismatic;
  guided.link_b = 4;
  model.loops.push_back(guided);
  Vector closed(5);
  closed << 1.1, 1.1, -1.1, 0.7, -0.7;
  expect_projection_closes(model, closed, 1e-3, random);
}

TEST_P(Projection, leaves_a_closed_state_alone) {
  const Model model = test::four_bar_chain(2);
  const Vector q = test::vector_of(test::four_bar_chain_pose(2, [](int) { return 1.1; }));
  const Vector qd = test::closed_velocity(model, q, test::vector_of(random.numbers(6, 1)));
  const Plan<double> plan(model);
  System system(plan, false);
  std::vector<double> y(q.data(), q.data() + 6);
  y.insert(y.end(), qd.data(), qd.data() + 6);
  std::vector<double> before = y;
  ASSERT_EQ(system.project(0, y.data(), nullptr), Status::ok);
  for (std::size_t i = 0; i < y.size(); ++i) EXPECT_NEAR(y[i], before[i], 1e-13);
}

}  // namespace
}  // namespace redysim
