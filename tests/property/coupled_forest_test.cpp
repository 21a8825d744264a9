#include <gtest/gtest.h>

#include <algorithm>

#include "support/dense.hpp"
#include "support/random_loops.hpp"

// Rigid couplings within several trees: some clusters are eliminated by fronts, others as a whole.

namespace redysim {
namespace {

using test::Evaluate;
using test::Matrix;
using test::Random;
using test::Vector;

constexpr unsigned seeds = 80;
constexpr int trees = 4, links_each = 6, links = trees * links_each;

// Chains from the ground. In each the first joints are coupled one after the other, in random order.
Model coupled_forest(Random& random) {
  test::TreeOptions options;
  options.links = links;
  options.branches = options.fixed = options.massless = options.springs = options.resistance = false;
  Model model = test::random_tree(random, options);
  for (int tree = 0; tree < trees; ++tree) {
    const int first = tree * links_each, coupled = 1 + random.index(links_each - 1);
    model.links[first].parent = ground;
    for (int link = first; link < first + coupled; ++link) {
      Coupling coupling;
      coupling.links = {link, link + 1};
      coupling.ratios = {1, random.between(0.5, 2)};
      const auto at = model.couplings.begin() + random.index(static_cast<int>(model.couplings.size()) + 1);
      model.couplings.insert(at, coupling);
    }
  }
  return model;
}

Matrix coupling_jacobian(const Model& model) {
  Matrix J = Matrix::Zero(static_cast<Eigen::Index>(model.couplings.size()), links);
  for (std::size_t row = 0; row < model.couplings.size(); ++row)
    for (int end = 0; end < 2; ++end)
      J(static_cast<Eigen::Index>(row), model.couplings[row].links[end]) = model.couplings[row].ratios[end];
  return J;
}

// M qdd + bias = tau + J^T lambda, J qdd = 0.
Vector dense_accelerations(const Model& model, const Vector& q, const Vector& qd, const Vector& tau) {
  Model open = model;
  open.couplings.clear();
  Evaluate<double> tree(open);
  const Matrix J = coupling_jacobian(model);
  Matrix A = Matrix::Zero(links + J.rows(), links + J.rows());
  A.topLeftCorner(links, links) = tree.inertia(q);
  A.topRightCorner(links, J.rows()) = -J.transpose();
  A.bottomLeftCorner(J.rows(), links) = J;
  Vector right = Vector::Zero(A.rows());
  right.head(links) = tau - tree.tau(q, qd, Vector::Zero(links));
  return test::solve(A, right).col(0).head(links);
}

TEST(CoupledForests, accelerate_as_in_a_dense_solve) {
  unsigned mixed = 0;
  for (unsigned seed = 0; seed < seeds; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const Model model = coupled_forest(random);
    const Vector q = test::vector_of(random.numbers(links, 2)),
                 qd = test::vector_of(random.numbers(links, 2)),
                 tau = test::vector_of(random.numbers(links, 5));
    Evaluate<double> tree(model);
    const Vector found = tree.qdd(q, qd, tau);
    EXPECT_LT(test::relative_difference(found, dense_accelerations(model, q, qd, tau)), 1e-8);
    const auto is_split = [](const ClusterPlan& cluster) { return cluster.split; };
    const auto split = std::count_if(tree.plan.clusters.begin(), tree.plan.clusters.end(), is_split);
    mixed += tree.ws.loop.by_fronts && split > 0 && split < trees ? 1 : 0;
  }
  EXPECT_GE(mixed, 20u);
}

}  // namespace
}  // namespace redysim
