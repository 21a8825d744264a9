#include <gtest/gtest.h>

#include "dynamics/loops/loop_correction.hpp"
#include "support/dense.hpp"
#include "support/random_loops.hpp"

// Loops that cross each other's joints and meet at different bodies, against dense solves by Eigen.

namespace redysim {
namespace {

using test::Evaluate;
using test::Matrix;
using test::Random;
using test::relative_difference;
using test::Vector;

constexpr unsigned seeds = 60;
constexpr unsigned most = 50;  // of them at least are to be without doubt about the rank

struct OverlappingCase {
  Model model;
  Vector q, qd, tau;
};

// A chain with side arms; each loop goes from one link to one a few links on, the last one to an arm. Those
// of type `point` are tied to the ground's directions: they cross all joints down to it.
OverlappingCase overlapping_case(Random& random) {
  constexpr int chain = 32;
  test::TreeOptions options;
  options.links = 38;
  options.branches = options.fixed = options.massless = false;
  options.springs = random.chance(0.3);
  OverlappingCase c;
  c.model = test::random_tree(random, options);
  for (int arm = chain; arm < options.links; ++arm) c.model.links[arm].parent = 2 + random.index(chain - 3);
  c.q = test::vector_of(random.numbers(options.links, 2));
  const std::vector<Pose> poses = test::poses_at(c.model, c.q);
  const auto add = [&](LoopType type, int a, int b) {
    if (random.chance(0.5)) std::swap(a, b);
    c.model.loops.push_back(test::closed_loop(random, type, a, b, poses));
  };
  constexpr LoopType types[] = {LoopType::universal, LoopType::spherical, LoopType::cylindrical};
  for (int a = 1; a + 10 < chain; a += 5 + random.index(2)) add(types[random.index(3)], a, a + 9);
  if (random.chance(0.3)) add(LoopType::point, 4 + random.index(5), 16 + random.index(5));
  const int arm = chain + random.index(options.links - chain);
  add(LoopType::spherical, arm, std::max(0, c.model.links[arm].parent - 4));
  c.tau = test::vector_of(random.numbers(options.links, 5));
  c.qd = test::closed_velocity(c.model, c.q, test::vector_of(random.numbers(options.links, 2)));
  return c;
}

// x of M x - J^T lambda = force, J x = rows, and lambda behind it, all at once.
Vector dense_answer(const test::DenseSolution& dense, const Vector& force, const Vector& rows) {
  const Eigen::Index n = dense.M.rows(), m = dense.J.rows();
  Matrix A = Matrix::Zero(n + m, n + m);
  A.topLeftCorner(n, n) = dense.M;
  A.topRightCorner(n, m) = -dense.J.transpose();
  A.bottomLeftCorner(m, n) = dense.J;
  Vector right(n + m);
  right << force, rows;
  return test::solve(A, right);
}

// Runs `law` on the random cases that are eliminated by fronts.
template <class Law>
void for_cases_by_fronts(Law law) {
  unsigned cases = 0;
  for (unsigned seed = 0; seed < seeds; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const OverlappingCase c = overlapping_case(random);
    Evaluate<double> tree(c.model);
    const Vector qdd = tree.qdd(c.q, c.qd, c.tau);
    if (!tree.ws.loop.by_fronts) continue;
    ++cases;
    EXPECT_GT(tree.plan.fronts.size(), 1u);
    law(random, c, tree, qdd);
  }
  EXPECT_GE(cases, most);
}

TEST(OverlappingLoopSets, accelerate_as_in_a_dense_solve) {
  for_cases_by_fronts([](Random&, const OverlappingCase& c, Evaluate<double>& tree, const Vector& qdd) {
    const test::DenseSolution dense = test::dense_solution(c.model, c.q, c.qd, c.tau);
    const Vector answer = dense_answer(dense, c.tau - dense.bias, -dense.quadratic);
    EXPECT_EQ(tree.rank(), dense.rank);
    EXPECT_LT(relative_difference(qdd, answer.head(qdd.size())), 1e-9);
    EXPECT_LT(relative_difference(tree.lambda(), answer.tail(dense.J.rows())), 1e-9);
  });
}

TEST(OverlappingLoopSets, answer_pushes_and_residuals_as_in_a_dense_solve) {
  for_cases_by_fronts(
      [](Random& random, const OverlappingCase& c, Evaluate<double>& tree, const Vector& qdd) {
        const test::DenseSolution dense = test::dense_solution(c.model, c.q, c.qd, c.tau);
        const Vector force = test::vector_of(random.numbers(tree.nv(), 1));
        const Vector rows = test::vector_of(random.numbers(static_cast<int>(dense.J.rows()), 1));
        tree.qdd(c.q, c.qd, c.tau);
        for (Eigen::Index row = 0; row < rows.size(); ++row) tree.ws.loop.b[row] = rows[row];
        Vector found(qdd.size());
        respond(tree.plan, tree.ws, force.data(), found.data());
        EXPECT_LT(relative_difference(found, dense_answer(dense, force, rows).head(qdd.size())), 1e-9);
      });
}

TEST(OverlappingLoopSets, answer_a_change_of_forces_in_dual_numbers) {
  for_cases_by_fronts([](Random& random, const OverlappingCase& c, Evaluate<double>&, const Vector& qdd) {
    const test::DenseSolution dense = test::dense_solution(c.model, c.q, c.qd, c.tau);
    const Vector change = test::vector_of(random.numbers(static_cast<int>(qdd.size()), 1));
    const Vector zero = Vector::Zero(qdd.size());
    Evaluate<Dual> exact(c.model);
    const Vector found =
        test::derivative(exact.qdd(test::dual(c.q, zero), test::dual(c.qd, zero), test::dual(c.tau, change)));
    const Vector answer = dense_answer(dense, change, Vector::Zero(dense.J.rows()));
    EXPECT_LT(relative_difference(found, answer.head(qdd.size())), 1e-9);
  });
}

// A loop given twice leaves the rank open: the set is then solved as a whole, by least norm.
TEST(OverlappingLoopSets, share_a_load_where_a_loop_is_given_twice) {
  for_cases_by_fronts([](Random&, const OverlappingCase& c, Evaluate<double>& tree, const Vector& qdd) {
    Model twice = c.model;
    twice.loops.push_back(twice.loops.front());
    Evaluate<double> redundant(twice);
    EXPECT_LT(relative_difference(redundant.qdd(c.q, c.qd, c.tau), qdd), 1e-8);
    EXPECT_FALSE(redundant.ws.loop.by_fronts);
    EXPECT_EQ(redundant.rank(), tree.rank());
  });
}

}  // namespace
}  // namespace redysim
