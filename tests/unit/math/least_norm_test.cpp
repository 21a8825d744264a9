#include "math/least_norm.hpp"

#include <gtest/gtest.h>

#include <Eigen/SVD>

#include "support/random_tree.hpp"

namespace redysim {
namespace {

// Of rank 4: the last two rows repeat others.
Eigen::MatrixXd deficient(test::Random& random) {
  Eigen::MatrixXd J(6, 7);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 7; ++j) J(i, j) = random.between(-1, 1);
  J.row(4) = 2 * J.row(1);
  J.row(5) = J.row(0) - J.row(3);
  return J;
}

Eigen::VectorXd random_vector(test::Random& random, int size) {
  const std::vector<double> v = random.numbers(size, 1);
  return Eigen::Map<const Eigen::VectorXd>(v.data(), size);
}

TEST(LeastNorm, is_the_pseudo_inverse_and_that_of_the_transpose) {
  test::Random random(1);
  const Eigen::MatrixXd J = deficient(random);
  Eigen::JacobiSVD<Eigen::MatrixXd> svd(J, Eigen::ComputeThinU | Eigen::ComputeThinV);
  svd.setThreshold(1e-10);
  const LeastNorm inverse(J, 1e-10);
  const Eigen::VectorXd b = random_vector(random, 6), x = random_vector(random, 7);
  EXPECT_LT((inverse.solve(b) - svd.solve(b)).norm(), 1e-13);
  EXPECT_LT((x - J.transpose() * inverse.solve_transposed(x) - (x - inverse.solve(J * x))).norm(), 1e-13);
  EXPECT_LT((inverse.left_null_space().transpose() * inverse.solve_transposed(x)).norm(), 1e-13);
  EXPECT_EQ(inverse.left_null_space().cols(), 2);
}

TEST(LeastNorm, damped_steps_are_the_same_by_both_ways) {
  test::Random random(2);
  const Eigen::MatrixXd J = deficient(random);
  const Eigen::VectorXd b = random_vector(random, 6);
  for (const double damping : {1e-5, 0.1, 10.0})
    EXPECT_LT((damped(J, b, damping) - LeastNorm(J, 1e-10).solve(b, damping)).norm(), 1e-5);
}

}  // namespace
}  // namespace redysim
