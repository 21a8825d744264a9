#include "math/bicubic_spline.hpp"

#include <gtest/gtest.h>

#include "support/random_tree.hpp"

namespace redysim {
namespace {

class Terrain : public testing::TestWithParam<unsigned> {
 protected:
  test::Random random{GetParam()};
  static constexpr int rows = 5, columns = 7;
  static constexpr double spacing = 0.3;
  std::vector<double> heights = random.numbers(rows * columns, 1);
  BicubicSpline spline{rows, columns, spacing, heights};
};
INSTANTIATE_TEST_SUITE_P(Seed, Terrain, testing::Range(0u, 10u));

TEST_P(Terrain, passes_through_its_grid_points) {
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      EXPECT_NEAR(spline.at(column * spacing, row * spacing).z, heights[row * columns + column], 1e-14);
}

TEST_P(Terrain, has_continuous_second_derivatives) {
  const double h = 1e-7 * spacing;
  for (int row = 1; row + 1 < rows; ++row)
    for (int column = 1; column + 1 < columns; ++column) {
      const double x = column * spacing, y = (row + 0.3) * spacing;
      const auto left = spline.at(x - h, y), right = spline.at(x + h, y);
      EXPECT_NEAR(left.zxx, right.zxx, 1e-4);
      EXPECT_NEAR(left.zxy, right.zxy, 1e-4);
      EXPECT_NEAR(left.zyy, right.zyy, 1e-4);
    }
}

TEST_P(Terrain, its_derivatives_are_those_of_its_heights) {
  const double x = random.between(0.01, 1.7), y = random.between(0.01, 1.1);
  const auto at = spline.at(x, y);
  const auto by_x = spline.at(Dual(x, 1), Dual(y)), by_y = spline.at(Dual(x), Dual(y, 1));
  EXPECT_NEAR(at.zx, by_x.z.derivative, 1e-12);
  EXPECT_NEAR(at.zy, by_y.z.derivative, 1e-12);
  EXPECT_NEAR(at.zxx, by_x.zx.derivative, 1e-11);
  EXPECT_NEAR(at.zxy, by_y.zx.derivative, 1e-11);
  EXPECT_NEAR(at.zyy, by_y.zy.derivative, 1e-11);
}

TEST_P(Terrain, is_constant_beyond_its_border_and_never_above_its_bound) {
  const auto inside = spline.at(0.0, 0.5), outside = spline.at(-3.0, 0.5);
  EXPECT_EQ(outside.z, inside.z);
  EXPECT_EQ(outside.zx, 0);
  EXPECT_NEAR(spline.at(1e-9, 0.5).zx, 0, 1e-6);
  for (int k = 0; k < 200; ++k)
    EXPECT_LE(spline.at(random.between(-1, 3), random.between(-1, 2)).z, spline.highest());
}

}  // namespace
}  // namespace redysim
