#include "math/envelope_cholesky.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "support/allocation_count.hpp"
#include "support/dense.hpp"
#include "support/random_tree.hpp"

namespace redysim {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// S = B B^T where row i of B has entries in columns of rows first[i]..i only: S keeps the envelope.
struct Banded {
  std::vector<int> first;
  Matrix S;

  Banded(test::Random& random, int size, int band, double deficiency) {
    Matrix B = Matrix::Zero(size, size);
    for (int i = 0; i < size; ++i) {
      first.push_back(std::max(0, i - random.index(band + 1)));
      if (i > 0) first[i] = std::max(first[i], first[i - 1]);  // monotone: what meets in a row stays inside
      for (int j = first[i]; j <= i; ++j) B(i, j) = random.between(-1, 1);
      B(i, i) += 2;
    }
    for (int j = 0; j < size; ++j)
      if (random.chance(deficiency)) B.col(j).setZero();
    S = B * B.transpose();
  }
};

constexpr double pivot_tolerance = 1e-12;

// The scale of each row is its own diagonal.
EnvelopeCholesky<double> factored(const std::vector<int>& first, const Matrix& S) {
  EnvelopeCholesky<double> out(first);
  out.set_zero();
  for (int i = 0; i < S.rows(); ++i)
    for (int j = first[i]; j <= i; ++j) out.entry(i, j) = S(i, j);
  const Vector scale = S.diagonal();
  out.factor(scale.data(), pivot_tolerance);
  return out;
}

class EnvelopeFactor : public testing::TestWithParam<unsigned> {
 protected:
  test::Random random{GetParam()};
};
INSTANTIATE_TEST_SUITE_P(Seed, EnvelopeFactor, testing::Range(0u, 50u));

TEST_P(EnvelopeFactor, full_rank_solves_the_system) {
  const Banded banded(random, 3 + random.index(20), 5, 0);
  auto S = factored(banded.first, banded.S);
  const Vector b = Eigen::Map<const Vector>(random.numbers(S.size(), 1).data(), S.size());
  Vector x(S.size());
  S.solve(b.data(), x.data());
  EXPECT_EQ(S.rank(), S.size());
  EXPECT_LT((banded.S * x - b).lpNorm<Eigen::Infinity>(), 1e-10 * std::max(1.0, x.lpNorm<Eigen::Infinity>()));
}

TEST_P(EnvelopeFactor, deficient_rank_gives_the_pseudo_inverse) {
  const Banded banded(random, 3 + random.index(20), 5, 0.3);
  auto S = factored(banded.first, banded.S);
  const test::PseudoInverse reference = test::pseudo_inverse(banded.S, 1e-11);
  ASSERT_EQ(S.rank(), reference.rank);
  const std::vector<double> numbers = random.numbers(S.size(), 1);
  Vector x = banded.S * Eigen::Map<const Vector>(numbers.data(), S.size());
  const Vector expected = reference.matrix * x;
  S.solve(x.data(), x.data());
  S.reduce_norm(x.data());
  EXPECT_LT((x - expected).lpNorm<Eigen::Infinity>(),
            1e-7 * std::max(1.0, expected.lpNorm<Eigen::Infinity>()));
}

TEST_P(EnvelopeFactor, rank_does_not_depend_on_the_scale_of_the_rows) {
  const Banded banded(random, 3 + random.index(15), 4, 0.3);
  Vector scale(banded.S.rows());
  for (double& entry : scale) entry = std::pow(10.0, random.between(-3, 3));
  const Matrix scaled = scale.asDiagonal() * banded.S * scale.asDiagonal();
  EXPECT_EQ(factored(banded.first, scaled).rank(), factored(banded.first, banded.S).rank());
}

TEST_P(EnvelopeFactor, dependent_rows_of_any_units_change_nothing_but_the_norm) {
  const Banded banded(random, 3 + random.index(15), 4, 0.3);
  Vector units(banded.S.rows());
  for (double& entry : units) entry = random.chance(0.5) ? 1 : 1e6;
  const Matrix scaled = units.asDiagonal() * banded.S * units.asDiagonal();
  auto S = factored(banded.first, scaled);
  const std::vector<double> numbers = random.numbers(S.size(), 1);
  const Vector b =
      scaled * (units.cwiseInverse().asDiagonal() * Eigen::Map<const Vector>(numbers.data(), S.size()));
  Vector x(S.size());
  S.solve(b.data(), x.data());
  const double plain = x.norm();
  S.reduce_norm(x.data());
  EXPECT_LT(x.norm(), plain * (1 + 1e-9));
  const Vector left = units.cwiseInverse().asDiagonal() * (scaled * x - b);
  EXPECT_LT(left.lpNorm<Eigen::Infinity>(), 1e-9 * (1 + (units.asDiagonal() * x).lpNorm<Eigen::Infinity>()));
}

// Noise makes all rows independent: only as many as before are used, and these are satisfied.
TEST_P(EnvelopeFactor, a_held_rank_outlasts_noise) {
  const Banded banded(random, 12, 4, 0.3);
  EnvelopeCholesky<double> L = factored(banded.first, banded.S);
  const int rank = L.rank();
  Matrix noisy = banded.S;
  noisy.diagonal().array() += 1e-3;
  const Vector scale = noisy.diagonal(), b = Vector::Ones(12);
  for (const bool held : {true, false}) {
    L.hold_rank(held);
    L.set_zero();
    for (int i = 0; i < 12; ++i)
      for (int j = banded.first[i]; j <= i; ++j) L.entry(i, j) = noisy(i, j);
    L.factor(scale.data(), pivot_tolerance);
    EXPECT_EQ(L.rank(), held ? rank : 12);
    Vector x(12);
    L.solve(b.data(), x.data());
    L.reduce_norm(x.data());
    for (int i = 0; i < 12; ++i) {
      if (L.dependent(i))
        EXPECT_EQ(x[i], 0);
      else
        EXPECT_NEAR(noisy.row(i).dot(x), 1, 1e-9);
    }
  }
}

// Two directions of one point, one of which fades away: rounding in its place is no constraint.
TEST(EnvelopeCholesky, a_row_far_below_its_scale_is_dependent) {
  EnvelopeCholesky<double> S({0, 0});
  S.set_zero();
  S.entry(0, 0) = 1;
  S.entry(1, 1) = 1e-17;
  const double scale[] = {1, 1};
  S.factor(scale, pivot_tolerance);
  EXPECT_EQ(S.rank(), 1);
}

// Two directions that a light body serves alike, but for a part of 1e-12: that is for the levers to judge.
TEST(EnvelopeCholesky, takes_levers_where_inertias_leave_the_rank_in_doubt) {
  const double light = 1e6, c = 0.6, s = 0.8;
  EnvelopeCholesky<double> S({0, 0});
  S.set_zero();
  S.entry(0, 0) = light * light * c * c + 1;
  S.entry(1, 0) = light * light * c * s;
  S.entry(1, 1) = light * light * s * s + 1;
  const double scale[] = {S.entry(0, 0), S.entry(1, 1)};
  S.factor(scale, 1e-9);
  EXPECT_TRUE(S.doubtful());
  EXPECT_EQ(S.rank(), 1);
  double J[] = {c, 1, 0, s, 0, 1}, bound[] = {1, 1, 1, 1, 1, 1}, B[] = {light * c, 1, 0, light * s, 0, 1};
  double variance[9];
  S.find_dependent({J, bound, variance, 3}, 3e-5);
  S.factor_product(B, 3);
  EXPECT_EQ(S.rank(), 2);
  // along (s, -c) S is 1
  double x[] = {s, -c};
  S.solve(x, x);
  EXPECT_NEAR(x[0], s, 1e-9);
  EXPECT_NEAR(x[1], -c, 1e-9);
}

// Rows at an angle of 1e-5. The second one is omitted if b misses it by 1e-5, as in the passage of a singular
// configuration, or if the constraint is violated by more than the passage leaves.
TEST(EnvelopeCholesky, keeps_a_nearly_dependent_row_that_b_needs) {
  constexpr double sine = 1e-5, tolerance = 1e-9;
  const struct {
    double missing, violation;
    bool dependent;
  } cases[] = {{sine, 0, true}, {1, 0, false}, {1, 1e-6, true}};
  for (const auto& [missing, violation, dependent] : cases) {
    EnvelopeCholesky<double> S({0, 0});
    S.set_zero();
    S.entry(0, 0) = S.entry(1, 0) = 1;
    S.entry(1, 1) = 1 + sine * sine;
    const double scale[] = {1, 1}, b[] = {1, 1 + missing}, residual[] = {0, violation}, squared[] = {1, 1};
    S.factor(scale, tolerance);
    EXPECT_EQ(S.rank(), 1);
    const auto factor = [&S] {
      double J[] = {1, 0, 1, sine}, bound[] = {1, 1, 1, 1}, B[] = {1, 0, 1, sine};
      double variance[9];
      S.find_dependent({J, bound, variance, 2}, std::sqrt(tolerance));
      S.factor_product(B, 2);
    };
    factor();
    EXPECT_TRUE(S.dependent(1));
    EXPECT_EQ(S.mark_needed(b, residual, squared, 1, 0), !dependent);
    factor();
    EXPECT_FALSE(S.mark_needed(b, residual, squared, 1, 0));
    EXPECT_EQ(S.dependent(1), dependent);
    double x[2];
    S.solve(b, x);
    if (!dependent) {
      EXPECT_NEAR(x[1] * sine * sine, missing, 1e-6);
    }
  }
}

// A lever of 1e-3 that nothing else explains beside one of 1e3, and a row of rounding where levers of 1 could
// be.
TEST(EnvelopeCholesky, judges_each_lever_by_its_own_length) {
  EnvelopeCholesky<double> S({0, 0, 0});
  double J[] = {1e3, 1e-3, 0, 1e3, -1e-3, 0, 1e-16, 0, 1e-17},
         bound[] = {1e3, 1e-3, 0, 1e3, 1e-3, 0, 1, 0, 1};
  double variance[9];
  S.find_dependent({J, bound, variance, 3}, 3e-5);
  EXPECT_FALSE(S.dependent(0));
  EXPECT_FALSE(S.dependent(1));
  EXPECT_TRUE(S.dependent(2));
}

// Rounding of a row whose levers all cancel is no lever on a joint that it does not cross.
TEST(EnvelopeCholesky, takes_no_rounding_for_a_lever) {
  EnvelopeCholesky<double> S({0, 0});
  double J[] = {0.6, 0, 0.8, 1e-17, 2e-17, 0}, bound[] = {1, 1, 1, 1, 1, 0};
  double variance[9];
  S.find_dependent({J, bound, variance, 3}, 3e-5);
  EXPECT_TRUE(S.dependent(1));
}

// A row of rounding is no row, although its parts along others exceed its bounds on joints that it does not
// cross.
TEST(EnvelopeCholesky, takes_no_rounding_for_a_row) {
  EnvelopeCholesky<double> S({0, 0});
  double J[] = {0.6, 0.8, 1e-17, 0}, bound[] = {1, 1, 5e-10, 0};
  double variance[9];
  S.find_dependent({J, bound, variance, 2}, 3e-5);
  EXPECT_FALSE(S.dependent(0));
  EXPECT_TRUE(S.dependent(1));
}

// The third row repeats the first, but for a lever of 1e-12 in the first column.
TEST(EnvelopeCholesky, takes_no_violation_for_a_lever) {
  for (const double violation : {0.0, 1e-12}) {
    EnvelopeCholesky<double> S({0, 0, 0});
    double J[] = {0, 0.6, 0.8, 1, 0.3, 0, 1e-12, 0.6, 0.8}, bound[] = {0, 1, 1, 1, 1, 0, 1e-12, 1, 1};
    double variance[9];
    S.find_dependent({J, bound, variance, 3, violation * violation}, 3e-5);
    EXPECT_FALSE(S.dependent(0));
    EXPECT_FALSE(S.dependent(1));
    EXPECT_EQ(S.dependent(2), violation > 0);
  }
}

// The motion that the first row leaves free hardly moves the joint of the second row, but all levers are far
// from zero compared with their own bounds.
TEST(EnvelopeCholesky, keeps_a_row_that_a_nearly_locked_joint_meets) {
  for (const double lever : {1e-3, 1e-6}) {
    EnvelopeCholesky<double> S({0, 0});
    double J[] = {1, 0.01, lever, 0}, bound[] = {1, 1, 1, 0}, variance[4];
    S.find_dependent({J, bound, variance, 2}, 3e-5);
    EXPECT_FALSE(S.dependent(0));
    EXPECT_EQ(S.dependent(1), lever < 1e-4);
  }
}

// The third row repeats the first but for 1e-6 of its levers. Its part along the second one, the only one in
// the first column, is no lever of its own.
TEST(EnvelopeCholesky, takes_no_lever_of_another_row_for_its_own) {
  for (const double difference : {1e-6, 1e-3}) {
    EnvelopeCholesky<double> S({0, 0, 0});
    double J[] = {0, 0.6, 0.8, 1, 0.3, 0, 0, 0.6 + difference, 0.8}, bound[] = {0, 1, 1, 1, 1, 0, 0, 1, 1};
    double variance[9];
    S.find_dependent({J, bound, variance, 3}, 3e-5);
    EXPECT_FALSE(S.dependent(0));
    EXPECT_FALSE(S.dependent(1));
    EXPECT_EQ(S.dependent(2), difference < 1e-4);
  }
}

// Rows in very different units, the third like the second: L^T L has lost the first row.
TEST(EnvelopeCholesky, least_norm_has_all_digits_in_any_units) {
  const double large = 1e8;
  EnvelopeCholesky<double> S({0, 0, 0});
  S.set_zero();
  S.entry(0, 0) = 1;
  for (const int row : {1, 2}) {
    S.entry(row, 0) = large;
    for (int column = 1; column <= row; ++column) S.entry(row, column) = 2 * large * large;
  }
  const double scale[] = {1, 2 * large * large, 2 * large * large};
  S.factor(scale, 1e-9);
  EXPECT_EQ(S.rank(), 2);
  double x[] = {2, 3 * large, 3 * large};  // S x for L^T x = (2, 1)
  S.solve(x, x);
  S.reduce_norm(x);
  EXPECT_NEAR(x[0], 1, 1e-9);
  EXPECT_NEAR(x[1] * large, 0.5, 1e-9);
  EXPECT_NEAR(x[2] * large, 0.5, 1e-9);
}

// S = B B^T with a column of 1e8: S itself has lost the rest, its rows have not. Along (s, -c) S is 1 +
// 1e-16.
TEST(EnvelopeCholesky, a_product_keeps_the_digits_that_its_square_has_lost) {
  const double heavy = 1e8, c = 0.6, s = 0.8;
  EnvelopeCholesky<double> product({0, 0});
  double J[] = {1, 0, 0, 1}, bound[] = {1, 1, 1, 1};
  double variance[9];
  product.find_dependent({J, bound, variance, 2}, 3e-5);
  double B[] = {heavy * c, 1, 0, heavy * s, 0, 1};
  product.factor_product(B, 3);
  EXPECT_EQ(product.rank(), 2);
  double x[] = {s, -c};
  product.solve(x, x);
  EXPECT_NEAR(x[0], s, 1e-7);
  EXPECT_NEAR(x[1], -c, 1e-7);
  // B^T x: nothing in the heavy column, to the digits that a number of 1e-8 has
  const double* along = product.along().data();
  EXPECT_NEAR(B[0] * along[0] + B[3] * along[1], 0, 1e-15);
  EXPECT_NEAR(B[1] * along[0] + B[4] * along[1], s, 1e-7);
  EXPECT_NEAR(B[2] * along[0] + B[5] * along[1], -c, 1e-7);
}

TEST(EnvelopeCholesky, zero_matrix_has_rank_zero_and_solves_to_zero) {
  auto S = factored({0, 0, 1}, Matrix::Zero(3, 3));
  double x[] = {1, 2, 3};
  S.solve(x, x);
  EXPECT_EQ(S.rank(), 0);
  EXPECT_EQ(x[0], 0);
  EXPECT_EQ(x[2], 0);
}

TEST(EnvelopeCholesky, factor_and_solve_do_not_allocate) {
  test::Random random(3);
  const Banded banded(random, 12, 4, 0.3);
  auto S = factored(banded.first, banded.S);
  double x[12] = {1};
  const Vector scale = Vector::Ones(12);
  const long before = test::allocations;
  S.factor(scale.data(), pivot_tolerance);
  S.solve(x, x);
  S.reduce_norm(x);
  EXPECT_EQ(test::allocations, before);
}

}  // namespace
}  // namespace redysim
