#include "math/cubic_spline.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/random_tree.hpp"

namespace redysim {
namespace {

TEST(CubicSpline, has_slopes_that_make_its_second_derivative_continuous) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    test::Random random(seed);
    std::vector<double> x{0}, y = random.numbers(9, 1);
    while (x.size() < y.size()) x.push_back(x.back() + random.between(0.1, 2));
    const std::vector<double> slope = spline_slopes(x, y);
    EXPECT_EQ(slope.front(), 0);
    EXPECT_EQ(slope.back(), 0);
    for (std::size_t k = 1; k + 1 < x.size(); ++k) {
      const double h0 = x[k] - x[k - 1], h1 = x[k + 1] - x[k];
      const double before = 6 * (y[k - 1] - y[k]) / (h0 * h0) + (2 * slope[k - 1] + 4 * slope[k]) / h0;
      const double behind = 6 * (y[k + 1] - y[k]) / (h1 * h1) - (4 * slope[k] + 2 * slope[k + 1]) / h1;
      EXPECT_NEAR(before, behind, 1e-11 * (std::abs(before) + 1 / (h0 * h1)));
    }
  }
}

TEST(CubicSpline, reproduces_a_cubic_that_is_flat_at_both_ends) {
  const auto cubic = [](double x) { return x * x * (3 - 2 * x); };
  const std::vector<double> x{0, 0.2, 0.3, 0.7, 1};
  std::vector<double> y;
  for (const double at : x) y.push_back(cubic(at));
  const std::vector<double> slope = spline_slopes(x, y);
  for (std::size_t k = 0; k < x.size(); ++k) EXPECT_NEAR(slope[k], 6 * x[k] * (1 - x[k]), 1e-14);
}

TEST(CubicSpline, of_one_or_two_points_is_flat) {
  EXPECT_EQ(spline_slopes({0}, {1}), std::vector<double>(1, 0.0));
  EXPECT_EQ(spline_slopes({0, 1}, {1, 5}), std::vector<double>(2, 0.0));
}

}  // namespace
}  // namespace redysim
