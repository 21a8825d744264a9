#include "dynamics/derivatives.hpp"

#include <gtest/gtest.h>

#include "dynamics/energy.hpp"
#include "dynamics/joint_elimination.hpp"
#include "support/mechanisms.hpp"
#include "support/random_loops.hpp"

// Derivatives of forward dynamics against dual numbers through the recursion and against differences.

namespace redysim {
namespace {

using test::Evaluate;
using test::Matrix;
using test::relative_difference;
using test::Vector;

// One column a variable: accelerations, then the power.
struct Case {
  Model model;
  Vector q, qd, inputs;  // inputs: joints, then ports

  int nv() const { return static_cast<int>(q.size()); }

  Matrix found() const {
    Evaluate<double> tree(model);
    const Vector qdd = tree.qdd(q, qd, inputs);
    std::vector<JointVariable> variables;
    for (auto kind : {JointVariable::Kind::position, JointVariable::Kind::velocity})
      for (int i = 0; i < nv(); ++i) variables.push_back({kind, i});
    Matrix columns(nv() + 1, 2 * nv());
    Derivatives derivatives(tree.plan);
    Vector tau = inputs.head(nv());
    for (int i = 0; i < nv(); ++i)
      if (tree.plan.joints[i].prescribed)
        tau[i] = prescribed_force(tree.plan, tree.ws, i, q.data(), qd.data(), qdd.data());
    derivatives.evaluate(tree.plan, tree.ws, q.data(), qd.data(), qdd.data(), tau.data(),
                         inputs.data() + nv(), variables, columns.data(), static_cast<std::size_t>(nv() + 1));
    return columns;
  }

  Matrix by_dual_numbers() const {
    Evaluate<Dual> exact(model);
    Matrix columns(nv() + 1, 2 * nv());
    const Vector zero = Vector::Zero(nv());
    for (int j = 0; j < 2 * nv(); ++j) {
      const Vector unit = Vector::Unit(nv(), j % nv());
      const auto at = test::dual(q, j < nv() ? unit : zero), rate = test::dual(qd, j < nv() ? zero : unit);
      const auto held = test::dual(inputs, Vector::Zero(inputs.size()));
      columns.col(j) << test::derivative(exact.qdd(at, rate, held)),
          external_power(exact.plan, exact.ws, at.data(), rate.data(), held.data()).derivative;
    }
    return columns;
  }

  Matrix by_differences() const {
    Evaluate<double> tree(model);
    Matrix columns(nv(), 2 * nv());
    constexpr double h = 1e-6;
    for (int j = 0; j < 2 * nv(); ++j) {
      const Vector step = h * Vector::Unit(nv(), j % nv());
      if (j < nv())
        columns.col(j) = (tree.qdd(q + step, qd, inputs) - tree.qdd(q - step, qd, inputs)) / (2 * h);
      else
        columns.col(j) = (tree.qdd(q, qd + step, inputs) - tree.qdd(q, qd - step, inputs)) / (2 * h);
    }
    return columns;
  }
};

void expect_agreement(const Case& c, double exactly, double roughly) {
  const Matrix found = c.found(), exact = c.by_dual_numbers(), differences = c.by_differences();
  for (int j = 0; j < 2 * c.nv(); ++j) {
    EXPECT_LT(relative_difference(found.col(j), exact.col(j)), exactly) << "variable " << j;
    EXPECT_LT(relative_difference(found.col(j).head(c.nv()), differences.col(j)), roughly)
        << "variable " << j;
  }
}

class OnRandomModels : public testing::TestWithParam<unsigned> {
 protected:
  OnRandomModels() : random(GetParam()) {}
  Vector numbers(Eigen::Index count, double size) {
    return test::vector_of(random.numbers(static_cast<int>(count), size));
  }
  // Prescribes a joint, and pushes at a frame in each kind of axes.
  void add_drives_and_ports(Model& model) {
    std::vector<Joint*> moving;
    for (Link& link : model.links)
      if (link.joint.type != JointType::fixed) moving.push_back(&link.joint);
    if (moving.size() > 2) moving[random.index(static_cast<int>(moving.size()))]->drive = Drive::motion;
    for (const Frame::Port port : {Frame::Port::ground_axes, Frame::Port::frame_axes}) {
      Frame frame;
      frame.name = "tool";
      frame.link = static_cast<int>(model.links.size()) - 1;
      frame.position = random.vector(0.3);
      frame.port = port;
      model.frames.push_back(frame);
    }
  }
  test::Random random;
};

INSTANTIATE_TEST_SUITE_P(Seed, OnRandomModels, testing::Range(0u, 40u));

TEST_P(OnRandomModels, derivatives_of_trees_are_exact) {
  Case c{test::random_tree(random, test::options_of(GetParam())), {}, {}, {}};
  const int n = test::moving_joints(c.model);
  c.q = numbers(n, 2);
  c.qd = numbers(n, 2);
  c.inputs = numbers(n, 5);
  expect_agreement(c, 1e-10, 1e-5);
}

TEST_P(OnRandomModels, derivatives_of_bushings_are_exact) {
  const test::TreeOptions options = test::options_of(GetParam());
  Case c{test::random_tree(random, options), {}, {}, {}};
  for (int k = 0; k < 2; ++k) c.model.bushings.push_back(test::random_bushing(random, options.links));
  const int n = test::moving_joints(c.model);
  c.q = numbers(n, 2);
  c.qd = numbers(n, 2);
  c.inputs = numbers(n, 5);
  expect_agreement(c, 1e-10, 1e-5);
}

TEST_P(OnRandomModels, derivatives_with_prescribed_joints_and_ports_are_exact) {
  Case c{test::random_tree(random, test::options_of(GetParam())), {}, {}, {}};
  add_drives_and_ports(c.model);
  const int n = test::moving_joints(c.model);
  c.q = numbers(n, 2);
  c.qd = numbers(n, 2);
  c.inputs = numbers(n + 12, 5);
  const Matrix found = c.found(), exact = c.by_dual_numbers();
  EXPECT_LT(relative_difference(found.topRows(n).reshaped(), exact.topRows(n).reshaped()), 1e-10);
}

TEST_P(OnRandomModels, derivatives_of_closed_loops_are_exact) {
  // long arms, so that no pose is singular
  Case c{test::serial_chain(9, false), numbers(9, 1), {}, numbers(9, 1)};
  const int last = random.chance(0.5) ? 8 : 7, first = random.index(3) - 1;
  const LoopType types[] = {LoopType::spherical, LoopType::universal, LoopType::revolute};
  c.model.loops = {
      test::closed_loop(random, types[random.index(3)], first, last, test::poses_at(c.model, c.q))};
  if (random.chance(0.5)) c.model.springs = test::random_tree(random, test::options_of(0)).springs;
  for (SpringDamper& spring : c.model.springs) spring.link_a = ground, spring.link_b = random.index(9);
  c.qd = test::closed_velocity(c.model, c.q, numbers(9, 1));
  expect_agreement(c, 1e-8, 1e-4);
}

// Constraints that depend on each other stay so along the motion: the accelerations move as if each were
// given once.
TEST_P(OnRandomModels, derivatives_do_not_mind_a_loop_given_twice) {
  Case c{test::serial_chain(9, false), numbers(9, 1), {}, numbers(9, 1)};
  c.model.loops = {test::closed_loop(random, LoopType::spherical, 0, 8, test::poses_at(c.model, c.q))};
  c.qd = test::closed_velocity(c.model, c.q, numbers(9, 1));
  const Matrix once = c.found();
  c.model.loops.push_back(c.model.loops.front());
  EXPECT_LT(relative_difference(c.found().reshaped(), once.reshaped()), 1e-7);
}

}  // namespace
}  // namespace redysim
