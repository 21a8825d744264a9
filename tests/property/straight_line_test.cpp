#include "dynamics/straight_line/straight_line.hpp"

#include <gtest/gtest.h>

#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>

#include "dynamics/ball.hpp"
#include "dynamics/input_layout.hpp"
#include "dynamics/joint_force.hpp"
#include "dynamics/straight_line/statement_order.hpp"
#include "math/recorded.hpp"
#include "support/dense.hpp"
#include "support/evaluate.hpp"
#include "support/random_loops.hpp"
#include "support/random_tree.hpp"

// The recorded recursion, run node by node, against the recursion.

namespace redysim {
namespace {

using test::Evaluate;
using test::relative_difference;
using test::vector_of;

test::Vector run(const StraightLine& line, const std::map<std::string, double>& symbols) {
  return vector_of(line.tape.values(line.qdd, symbols));
}

// Drive force of prescribed joint i. That of the line is without friction and stops.
double drive_force(const StraightLine& line, const std::map<std::string, double>& symbols,
                   const Plan<double>& plan, int i, double q, double qd) {
  return line.tape.values({line.drive[i]}, symbols)[0] -
         (plan.joints[i].has_resistance ? resistance_force(plan, i, q, qd) : 0);
}

void set(std::map<std::string, double>& symbols, const std::string& name, const std::vector<double>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) symbols[name + "[" + std::to_string(i) + "]"] = values[i];
}

// Values of the symbols. Forces in tau of the line include friction and stops.
std::map<std::string, double> symbols_at(const Plan<double>& plan, const std::vector<double>& q,
                                         const std::vector<double>& qd, std::vector<double> tau) {
  std::map<std::string, double> symbols;
  set(symbols, "q", q);
  set(symbols, "qd", qd);
  for (int i = 0; i < plan.nv; ++i)
    if (plan.joints[i].has_resistance && !plan.joints[i].prescribed)
      tau[i] += resistance_force(plan, i, q[i], qd[i]);
  set(symbols, "tau", tau);
  return symbols;
}

class StraightLines : public testing::TestWithParam<unsigned> {
 protected:
  test::Random random{GetParam()};
  Model tree() { return test::random_tree(random, test::options_of(GetParam())); }
};

TEST_P(StraightLines, say_what_the_recursion_says) {
  const Model model = tree();
  Evaluate<double> recursion(model);
  const StraightLine line = straight_line(model);
  const int n = recursion.nv();
  const auto q = random.numbers(n, 3), qd = random.numbers(n, 2), tau = random.numbers(n, 5);
  EXPECT_LT(relative_difference(run(line, symbols_at(recursion.plan, q, qd, tau)),
                                recursion.qdd(vector_of(q), vector_of(qd), vector_of(tau))),
            1e-10);
}

TEST_P(StraightLines, follow_prescribed_joints) {
  Model model = tree();
  for (Link& link : model.links)
    if (random.chance(0.4)) link.joint.drive = Drive::motion;
  Evaluate<double> recursion(model);
  const StraightLine line = straight_line(model);
  const int n = recursion.nv();
  const auto q = random.numbers(n, 3), qd = random.numbers(n, 2), tau = random.numbers(n, 5);
  const auto symbols = symbols_at(recursion.plan, q, qd, tau);
  const test::Vector qdd = recursion.qdd(vector_of(q), vector_of(qd), vector_of(tau));
  EXPECT_LT(relative_difference(run(line, symbols), qdd), 1e-10);
  const test::Vector forces = recursion.tau(vector_of(q), vector_of(qd), qdd);
  for (int i = 0; i < n; ++i) {
    if (!recursion.plan.joints[i].prescribed) continue;
    EXPECT_EQ(run(line, symbols)[i], tau[i]);
    EXPECT_NEAR(drive_force(line, symbols, recursion.plan, i, q[i], qd[i]), forces[i],
                1e-10 * (1 + forces.norm()));
  }
}

// In any chart, whose joint does not move.
TEST_P(StraightLines, include_spherical_joints) {
  Model model = tree();
  const int chart = static_cast<int>(model.links.size());
  for (int k = 0; k < 4; ++k) {
    Link link;
    link.name = link.joint.name = "ball" + std::to_string(k);
    link.parent = k > 0 ? chart + k - 1 : random.index(chart + 1) - 1;
    link.joint.dh.alpha = k == 1 ? 0.7 : 1.5707963267948966;
    if (k == 0) link.joint.drive = Drive::locked;
    if (k == 3) test::give_inertia(random, link);
    model.links.push_back(link);
  }
  model.balls.emplace_back().chart_link = chart;
  Evaluate<double> recursion(model);
  const StraightLine line = straight_line(model);
  const int n = recursion.nv();
  auto q = random.numbers(n, 3), qd = random.numbers(n, 2), tau = random.numbers(n, 5);
  for (const double angle : {0.0, 1.5707963267948966}) {
    q[n - 4] = angle;
    qd[n - 4] = tau[n - 4] = 0;
    EXPECT_LT(relative_difference(run(line, symbols_at(recursion.plan, q, qd, tau)),
                                  recursion.qdd(vector_of(q), vector_of(qd), vector_of(tau))),
              1e-10);
  }
}

TEST_P(StraightLines, leave_open_what_is_tunable) {
  Model model = tree();
  Link& last = model.links.back();
  if (last.joint.type == JointType::fixed) return;
  if (GetParam() % 2 == 1) last.joint.name = last.name;
  model.fmu.tunable = {"gravity[3]", last.name + ".mass"};
  for (const char* parameter : {".damping", ".stiffness", ".rest", ".armature", ".friction"})
    model.fmu.tunable.push_back(last.joint.name + parameter);
  const StraightLine line = straight_line(model);

  model.gravity = random.vector(10);
  test::give_inertia(random, model.links.back());
  last.joint.damping = random.between(1, 2);
  last.joint.stiffness = random.between(1, 2);
  last.joint.rest = random.between(-1, 1);
  last.joint.armature = random.between(1, 2);
  last.joint.friction = random.between(1, 2);
  Evaluate<double> recursion(model);
  const int n = recursion.nv();
  const auto q = random.numbers(n, 3), qd = random.numbers(n, 2), tau = random.numbers(n, 5);
  std::map<std::string, double> symbols = symbols_at(recursion.plan, q, qd, tau);
  set(symbols, "plan.gravity", {model.gravity.x(), model.gravity.y(), model.gravity.z()});
  const std::string place = "plan.joints[" + std::to_string(n - 1) + "].";
  const JointPlan<double>& joint = recursion.plan.joints.back();
  symbols[place + "damping"] = joint.damping;
  symbols[place + "stiffness"] = joint.stiffness;
  symbols[place + "rest"] = joint.rest;
  symbols[place + "armature"] = joint.armature;
  symbols[place + "inertia.mass"] = joint.inertia.mass;
  set(symbols, place + "inertia.h", {joint.inertia.h.x(), joint.inertia.h.y(), joint.inertia.h.z()});
  const Symmetric3<double>& I = joint.inertia.inertia;
  symbols[place + "inertia.inertia.xx"] = I.xx;
  symbols[place + "inertia.inertia.yy"] = I.yy;
  symbols[place + "inertia.inertia.zz"] = I.zz;
  symbols[place + "inertia.inertia.xy"] = I.xy;
  symbols[place + "inertia.inertia.xz"] = I.xz;
  symbols[place + "inertia.inertia.yz"] = I.yz;
  EXPECT_LT(
      relative_difference(run(line, symbols), recursion.qdd(vector_of(q), vector_of(qd), vector_of(tau))),
      1e-10);
}

TEST_P(StraightLines, have_each_operation_once_in_order) {
  const StraightLine line = straight_line(tree());
  for (bool two_chains : {false, true}) {
    const std::vector<int> order = statement_order(line.tape, line.qdd, two_chains);
    EXPECT_EQ(order.size(), static_cast<std::size_t>(operations(line)));
    std::set<int> seen;
    for (int node : order) {
      EXPECT_TRUE(seen.insert(node).second);
      if (two_chains) continue;
      for (int operand : {line.tape[node].left, line.tape[node].right}) {
        const bool is_operation = operand >= 0 && line.tape[operand].left >= 0;
        EXPECT_TRUE(!is_operation || seen.count(operand) == 1);
      }
    }
  }
}

TEST_P(StraightLines, include_wrenches_at_frames) {
  Model model = tree();
  for (const Frame::Port port : {Frame::Port::ground_axes, Frame::Port::frame_axes}) {
    Frame frame;
    frame.name = port == Frame::Port::ground_axes ? "hook" : "nozzle";
    frame.link = random.index(static_cast<int>(model.links.size()));
    frame.position = random.vector(1);
    frame.rotation = rotation_of(BallAngles{false, 0.3, -0.2, 0.5});
    frame.port = port;
    model.frames.push_back(frame);
  }
  Evaluate<double> recursion(model);
  const StraightLine line = straight_line(model);
  const int n = recursion.nv();
  const auto q = random.numbers(n, 3), qd = random.numbers(n, 2);
  const auto inputs = random.numbers(InputLayout(recursion.plan).recursion_size(), 5);
  EXPECT_LT(relative_difference(run(line, symbols_at(recursion.plan, q, qd, inputs)),
                                recursion.qdd(vector_of(q), vector_of(qd), vector_of(inputs))),
            1e-10);
}

INSTANTIATE_TEST_SUITE_P(Seeds, StraightLines, testing::Range(0u, 40u));

TEST(StraightLine, uses_values_as_soon_as_it_has_them) {
  Tape tape;
  const Recorded x(tape, tape.symbol("x"));
  const Recorded a = x * x, b = x * 3.0, c = x * 5.0, two = a + b, all = two + c;
  std::vector<int> wanted;
  for (const Recorded& each : {a, b, two, c, all}) wanted.push_back(each.node_on(tape));
  EXPECT_EQ(statement_order(tape, {wanted.back()}, false), wanted);
}

TEST(StraightLine, folds_a_pendulum_to_its_formula) {
  Model model;
  Link link;
  link.name = "rod";
  link.joint.name = "pivot";
  link.joint.dh.alpha = 1.5707963267948966;
  link.mass = 2;
  link.com = {0.5, 0, 0};
  model.links = {link};
  // qdd = (tau - m g c cos q) / (m c^2): sin is not needed
  EXPECT_LE(operations(straight_line(model)), 5);
}

// Near the position where both axes of a universal joint lie along a slender body, what resists the first
// axis is 1e-8 of the inertias that the base parameters would move onto the cross.
TEST(StraightLine, keeps_the_digits_of_a_light_cross) {
  Model model;
  Link cross, rod;
  cross.name = cross.joint.name = "cross";
  cross.inertia = {1e-12, 1e-12, 1e-12, 0, 0, 0};
  rod.name = rod.joint.name = "rod";
  rod.parent = 0;
  rod.joint.dh.alpha = 1.5707963267948966;
  rod.mass = 2;
  rod.com = {0.5, 0, 0};
  rod.inertia = {0, 0.2, 0.2, 0, 0, 0};
  model.links = {cross, rod};
  Evaluate<double> recursion(model);
  const std::vector<double> q = {0.3, 1.5707963267948966 - 1e-4}, qd = {0.2, -0.1}, tau = {1e-7, 1};
  EXPECT_LT(relative_difference(run(straight_line(model), symbols_at(recursion.plan, q, qd, tau)),
                                recursion.qdd(vector_of(q), vector_of(qd), vector_of(tau))),
            1e-12);
}

TEST(StraightLine, refuses_what_it_cannot_write_down) {
  test::Random random(1);
  Model model = test::random_tree(random, {});
  model.bushings.emplace_back();
  EXPECT_THROW(straight_line(model), std::domain_error);
}

std::vector<double> numbers(const test::Vector& v) { return {v.begin(), v.end()}; }

// A random tree of 9 links with loops of all types, which starts where they are closed.
test::ClosedCase closed_case(test::Random& random, unsigned seed) {
  const std::vector<LoopType> types(std::begin(test::all_loop_types), std::end(test::all_loop_types));
  test::ClosedCase c = test::random_case(random, 9, 1 + static_cast<int>(seed % 2), types);
  const Plan<double> plan(c.model);
  for (int i = 0; i < plan.nv; ++i) c.model.links[plan.joints[i].link].joint.q0 = c.q[i];
  return c;
}

// Without value: rows of the loops are dependent.
std::optional<StraightLine> line_if_independent(const Model& model) {
  try {
    return straight_line(model);
  } catch (const std::domain_error&) {
    return std::nullopt;
  }
}

// Loops whose rows are independent: accelerations, corrections and residuals against a dense solve.
TEST(StraightLine, closes_loops) {
  int compared = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    const test::ClosedCase c = closed_case(random, seed);
    const std::optional<StraightLine> found = line_if_independent(c.model);
    if (!found) continue;
    ++compared;
    const StraightLine& line = *found;
    Evaluate<double> recursion(c.model);
    const auto symbols = symbols_at(recursion.plan, numbers(c.q), numbers(c.qd), numbers(c.tau));
    const test::DenseSolution dense = test::dense_solution(c.model, c.q, c.qd, c.tau);
    EXPECT_LT(relative_difference(run(line, symbols), dense.qdd), 1e-9);

    const test::Matrix corrections =
        test::solve_definite(dense.M, dense.J.transpose()) * test::pseudo_inverse(dense.S).matrix;
    const test::Vector C = vector_of(line.tape.values(line.corrections, symbols));
    EXPECT_LT(relative_difference(C, corrections.transpose().reshaped()), 1e-9);

    const test::Vector q = c.q + 0.1 * vector_of(random.numbers(recursion.nv(), 1)),
                       qd = vector_of(random.numbers(recursion.nv(), 1));
    const auto elsewhere = symbols_at(recursion.plan, numbers(q), numbers(qd), numbers(c.tau));
    EXPECT_LT(
        relative_difference(vector_of(line.tape.values(line.residual, elsewhere)), recursion.residual(q, qd)),
        1e-14);
    EXPECT_LT(relative_difference(vector_of(line.tape.values(line.rate, elsewhere)), recursion.rate(q, qd)),
              1e-13);
  }
  EXPECT_GT(compared, 20);
}

// A joint that is given the acceleration which its force produces: the others move as before, and it needs
// this force. Corrections do not move it.
TEST(StraightLine, closes_loops_around_a_prescribed_joint) {
  int compared = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    test::ClosedCase c = closed_case(random, seed);
    const test::DenseSolution dense = test::dense_solution(c.model, c.q, c.qd, c.tau);
    const Plan<double> free(c.model);
    const int held = random.index(free.nv);
    c.model.links[free.joints[held].link].joint.drive = Drive::motion;
    const double force = c.tau[held];
    c.tau[held] = dense.qdd[held];
    const std::optional<StraightLine> found = line_if_independent(c.model);
    if (!found) continue;
    const StraightLine& line = *found;
    test::Matrix J = dense.J;
    J.col(held).setZero();
    // otherwise the loops hold the joint, and its force may be any
    const test::Matrix S = J * test::solve_definite(dense.M, J.transpose());
    if ((test::eigenvalues(S).array() > 1e-10 * dense.S.norm()).count() < dense.rank) continue;
    ++compared;
    const Plan<double> plan(c.model);
    const auto symbols = symbols_at(plan, numbers(c.q), numbers(c.qd), numbers(c.tau));
    EXPECT_LT(relative_difference(run(line, symbols), dense.qdd), 1e-8);
    EXPECT_NEAR(drive_force(line, symbols, plan, held, c.q[held], c.qd[held]), force,
                1e-8 * (1 + std::abs(force) + dense.bias.norm() + dense.lambda.norm()));

    const test::Vector values = vector_of(line.tape.values(line.corrections, symbols));
    const test::Matrix C = values.reshaped(dense.J.rows(), free.nv).transpose();
    EXPECT_EQ(C.row(held).norm(), 0);
    EXPECT_LT((J * C * J - J).norm(), 1e-8 * J.norm());
  }
  EXPECT_GT(compared, 20);
}

}  // namespace
}  // namespace redysim
