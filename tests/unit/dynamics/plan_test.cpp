#include "dynamics/plan.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "dynamics/aba.hpp"
#include "dynamics/compiled.hpp"
#include "dynamics/energy.hpp"
#include "dynamics/rnea.hpp"
#include "support/allocation_count.hpp"
#include "support/evaluate.hpp"
#include "support/mechanisms.hpp"
#include "support/random_tree.hpp"

namespace redysim {
namespace {

using test::Evaluate;
using test::Vector;

TEST(Plan, right_angles_need_no_general_rotation) {
  const double quarter = std::acos(-1.0) / 2;
  Model model = test::serial_chain(4, true);
  model.links[0].joint.dh.alpha = 90 * (std::acos(-1.0) / 180);
  model.links[1].joint.dh.alpha = -quarter;
  model.links[2].joint.dh.alpha = 0;
  model.links[3].joint.dh.alpha = 0.3;
  const Plan<double> plan(model);
  EXPECT_EQ(plan.joints[0].twist, Twist::plus_90);
  EXPECT_EQ(plan.joints[1].twist, Twist::minus_90);
  EXPECT_EQ(plan.joints[2].twist, Twist::none);
  EXPECT_EQ(plan.joints[3].twist, Twist::general);
}

TEST(Plan, parallel_axes_need_no_branch) {
  Model model = test::serial_chain(1, true);
  model.links[0].joint.dh = {0.4, 0.3, 0, 0, 0.2, 0.1};
  const Plan<double> plan(model);
  EXPECT_FALSE(plan.joints[0].branch);
  EXPECT_DOUBLE_EQ(plan.joints[0].d, 0.4);
  EXPECT_DOUBLE_EQ(plan.joints[0].theta, 0.6);
}

TEST(Plan, fixed_links_have_no_joint) {
  Model model = test::serial_chain(5, false);
  model.links[0].joint.type = model.links[2].joint.type = JointType::fixed;
  const Plan<double> plan(model);
  EXPECT_EQ(plan.nv, 3);
  EXPECT_EQ(plan.carrier, (std::vector<int>{ground, 0, 0, 1, 2}));
  EXPECT_NEAR(plan.joints[0].inertia.mass, 2, 1e-15);
}

TEST(Plan, an_open_tree_holds_nothing_for_loops) {
  const Plan<double> plan(test::serial_chain(5, false));
  const Workspace<double> ws(plan);
  EXPECT_TRUE(plan.poses.empty());
  EXPECT_TRUE(plan.elimination.empty());
  EXPECT_TRUE(ws.ground.empty());
  EXPECT_TRUE(ws.loop.lambda.empty());
}

TEST(Workspace, is_born_full_of_nan) {
  const Workspace<double> ws{Plan<double>(test::serial_chain(3, false))};
  for (const auto& joint : ws.joints) {
    EXPECT_TRUE(std::isnan(joint.cosine));
    EXPECT_TRUE(std::isnan(joint.acceleration.linear.x()));
  }
}

// Models of every kind, with a start state.
struct Case {
  Model model;
  Vector q;
};

std::vector<Case> cases() {
  test::Random random(1);
  std::vector<Case> out{{test::serial_chain(7, false), {}},
                        {test::random_tree(random, test::options_of(14)), {}}};
  for (Case& c : out) c.q = test::vector_of(random.numbers(Plan<double>(c.model).nv, 1));
  out.push_back(
      {test::four_bar_chain(3), test::vector_of(test::four_bar_chain_pose(3, [](int) { return 1.2; }))});
  return out;
}

TEST(Recursions, do_not_allocate) {
  for (const Case& c : cases()) {
    Evaluate<double> tree(c.model);
    const Vector v = 0.3 * c.q;
    const Parameters<double> parameters = parameters_of(c.model);
    Vector out(tree.nv());
    const long before = test::allocations;
    forward_dynamics(tree.plan, tree.ws, c.q.data(), v.data(), v.data(), out.data());
    compiled_forward_dynamics(tree.plan, tree.ws, c.q.data(), v.data(), v.data(), out.data());
    inverse_dynamics(tree.plan, tree.ws, c.q.data(), v.data(), v.data(), out.data());
    kinetic_energy(tree.plan, tree.ws, c.q.data(), v.data());
    potential_energy(tree.plan, tree.ws, c.q.data(), v.data());
    tree.plan.update(parameters);
    EXPECT_EQ(test::allocations, before);
  }
}

TEST(CompiledRecursions, agree_with_the_templates) {
  for (const Case& c : cases()) {
    Evaluate<double> tree(c.model);
    const Vector v = 0.3 * c.q, tau = 2 * c.q;
    Vector out(tree.nv());
    compiled_forward_dynamics(tree.plan, tree.ws, c.q.data(), v.data(), tau.data(), out.data());
    EXPECT_LT(test::relative_difference(out, tree.qdd(c.q, v, tau)), 1e-11);
    // that of processors without AVX2
    plain_forward_dynamics(tree.plan, tree.ws, c.q.data(), v.data(), tau.data(), out.data());
    EXPECT_LT(test::relative_difference(out, tree.qdd(c.q, v, tau)), 1e-11);
    compiled_inverse_dynamics(tree.plan, tree.ws, c.q.data(), v.data(), tau.data(), out.data());
    EXPECT_LT(test::relative_difference(out, tree.tau(c.q, v, tau)), 1e-13);
  }
}

TEST(Recursions, repeat_bit_by_bit_in_a_used_workspace) {
  for (const Case& c : cases()) {
    Evaluate<double> tree(c.model), fresh(c.model);
    const Vector v = 0.3 * c.q, tau = 2 * c.q;
    tree.inertia(v);
    tree.tau(v, tau, c.q);
    tree.kinetic(v, tau);
    EXPECT_EQ((tree.qdd(c.q, v, tau) - fresh.qdd(c.q, v, tau)).norm(), 0);
  }
}

TEST(ForwardDynamics, says_by_a_non_finite_number_that_a_state_is_broken) {
  Evaluate<double> tree(test::serial_chain(3, false));
  const Vector v = Vector::Zero(3);
  Vector q = v;
  q[1] = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(tree.qdd(q, v, v).allFinite());
}

}  // namespace
}  // namespace redysim
