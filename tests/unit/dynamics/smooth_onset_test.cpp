#include "dynamics/smooth_onset.hpp"

#include <gtest/gtest.h>

#include "math/dual.hpp"

namespace redysim {
namespace {

constexpr double width = 0.3;

TEST(SmoothOnset, its_force_is_twice_differentiable_at_both_ends) {
  const double h = 1e-6;
  for (const double x : {0.0, width}) {
    const auto slope = [](double depth) { return SmoothOnset<double>(depth, width).slope(); };
    const double before = x > h ? (slope(x) - slope(x - h)) / h : 0, after = (slope(x + h) - slope(x)) / h;
    EXPECT_NEAR(before, 0, 1e-4);
    EXPECT_NEAR(after, 0, 1e-4);
  }
}

TEST(SmoothOnset, is_a_linear_spring_behind_its_width) {
  for (const double x : {0.3, 0.5, 7.0}) {
    EXPECT_NEAR(SmoothOnset<double>(x, width).force(), x - width / 2, 1e-15 * x);
    EXPECT_EQ(SmoothOnset<double>(x, width).slope(), 1);
  }
}

TEST(SmoothOnset, energy_force_and_slope_are_derivatives_of_one_another) {
  for (const double x : {1e-9, 0.01, 0.15, 0.29, 0.31, 2.0}) {
    const SmoothOnset<Dual> onset(Dual(x, 1), Dual(width));
    EXPECT_NEAR(onset.energy().derivative, onset.force().value, 1e-15);
    EXPECT_NEAR(onset.force().derivative, onset.slope().value, 1e-15);
  }
}

TEST(ImpactGrowth, is_positive_and_that_of_hunt_and_crossley_for_slow_impacts) {
  EXPECT_NEAR(impact_growth(1e-5), 1 + 1e-5, 1e-10);
  EXPECT_GT(impact_growth(-1e6), 0);
  for (const double s : {0.1, 1.0, 30.0}) EXPECT_NEAR(impact_growth(s) * impact_growth(-s), 1, 1e-12);
}

}  // namespace
}  // namespace redysim
