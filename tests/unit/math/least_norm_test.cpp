#include "math/least_norm.hpp"

#include <gtest/gtest.h>

#include "support/dense.hpp"
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
  const LeastNorm inverse(J, 1e-10);
  const Eigen::VectorXd b = random_vector(random, 6), x = random_vector(random, 7);
  EXPECT_LT((inverse.solve(b) - test::pseudo_inverse(J).matrix * b).norm(), 1e-13);
  EXPECT_LT((x - J.transpose() * inverse.solve_transposed(x) - (x - inverse.solve(J * x))).norm(), 1e-13);
  EXPECT_LT((inverse.left_null_space().transpose() * inverse.solve_transposed(x)).norm(), 1e-13);
  EXPECT_EQ(inverse.left_null_space().cols(), 2);
}

// Rows that are clearly independent are not decomposed. Duplicated rows with half the right-hand side each do
// not change the solution, but need the decomposition.
TEST(LeastNorm, independent_rows_give_what_the_decomposition_gives) {
  test::Random random(3);
  for (const double size : {1e-6, 1.0, 1e3}) {
    const Eigen::MatrixXd J = size * deficient(random).topRows(4);
    Eigen::MatrixXd twice(8, 7);
    twice << J, J;
    const LeastNorm inverse(J, 1e-8), of_both(twice, 1e-8);
    const Eigen::VectorXd b = random_vector(random, 4), x = random_vector(random, 7);
    EXPECT_EQ(inverse.left_null_space().cols(), 0);
    EXPECT_EQ(of_both.left_null_space().cols(), 4);
    const Eigen::VectorXd b_twice = b.replicate(2, 1), y = of_both.solve_transposed(x);
    EXPECT_LT((inverse.solve(b) - of_both.solve(b_twice)).norm(), 1e-13 / size);
    EXPECT_LT((J * inverse.solve(b) - b).norm(), 1e-14);
    EXPECT_LT((inverse.solve_transposed(x) - y.head(4) - y.tail(4)).norm(), 1e-13 / size);
  }
}

// Rows of neighbours, as in a row of four-bars: exact in spite of the squared condition number.
TEST(LeastNorm, long_rows_of_neighbours_are_solved_to_rounding) {
  const int n = 80;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(n, n + 1);
  for (int i = 0; i < n; ++i) J(i, i) = 1, J(i, i + 1) = -1;
  EXPECT_TRUE(RowFactor(J, 0, RowFactor::independent).is_complete());
  // x_i - x_i+1 = 1 with minimum norm
  const Eigen::VectorXd x = LeastNorm(J, 1e-8).solve(Eigen::VectorXd::Ones(n));
  for (int i = 0; i <= n; ++i) EXPECT_NEAR(x[i], 0.5 * n - i, 1e-12);
}

// A row that nearly follows from the others: singular values, not pivots, decide about the rank.
TEST(LeastNorm, nearly_dependent_rows_are_decomposed) {
  test::Random random(4);
  for (const double sine : {1e-3, 1e-6, 1e-10}) {
    Eigen::MatrixXd J = deficient(random).topRows(5);
    J(4, 6) += sine;
    EXPECT_FALSE(RowFactor(J, 0, RowFactor::independent).is_complete());
    EXPECT_EQ(LeastNorm(J, 1e-8).left_null_space().cols(), sine < 1e-8 ? 1 : 0);
  }
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
