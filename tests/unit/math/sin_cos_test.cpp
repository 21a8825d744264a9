#include "math/sin_cos.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "math/dual.hpp"
#include "support/random_tree.hpp"

namespace redysim {
namespace {

// Against the library in extended precision: one unit in the last place of 1.
void expect_close(const Lanes<double>& angle) {
  constexpr long double unit = std::numeric_limits<double>::epsilon();
  const SinCos<double> found = sin_cos(angle);
  for (int k = 0; k < 4; ++k) {
    const long double x = angle[k];
    EXPECT_LT(std::abs(found.sine[k] - std::sin(x)), unit / 2) << angle[k];
    EXPECT_LT(std::abs(found.cosine[k] - std::cos(x)), unit / 2) << angle[k];
  }
}

class SinCosUpTo : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Size, SinCosUpTo, testing::Values(1e-9, 0.78, 3.2, 100.0, 1e4, 9.9e4, 1e7));

TEST_P(SinCosUpTo, four_angles_at_once_are_those_of_the_library) {
  test::Random random(1);
  const double size = GetParam();
  auto any = [&random, size] { return random.between(-size, size); };
  for (int repeat = 0; repeat < 20000; ++repeat) expect_close(Lanes<double>::of(any(), any(), any(), any()));
}

TEST(SinCos, multiples_of_a_right_angle_are_those_of_the_library) {
  constexpr double right_angle = 1.5707963267948966;
  for (int k = -60000; k <= 60000; k += k > -20 && k < 20 ? 1 : 97) {
    const double x = k * right_angle;
    expect_close(Lanes<double>::of(x, std::nextafter(x, 1e9), -x, 0.5 * x));
  }
}

TEST(SinCos, zero_keeps_its_sign_and_what_is_not_finite_stays_so) {
  const SinCos<double> zero = sin_cos(Lanes<double>::of(0.0, -0.0, 1e-300, 0.0));
  EXPECT_FALSE(std::signbit(zero.sine[0]));
  EXPECT_TRUE(std::signbit(zero.sine[1]));
  EXPECT_EQ(zero.sine[2], 1e-300);
  EXPECT_EQ(zero.cosine[0], 1.0);
  const double infinity = std::numeric_limits<double>::infinity();
  const SinCos<double> lost = sin_cos(Lanes<double>::of(0.3, infinity, 0.4, std::nan("")));
  EXPECT_EQ(lost.sine[0], std::sin(0.3));
  EXPECT_TRUE(std::isnan(lost.sine[1]));
  EXPECT_EQ(lost.cosine[2], std::cos(0.4));
  EXPECT_TRUE(std::isnan(lost.cosine[3]));
}

TEST(SinCos, dual_numbers_carry_the_derivative) {
  const Dual angle(0.7, 2);
  const SinCos<Dual> found = sin_cos(Lanes<Dual>::of(angle, angle, angle, angle));
  EXPECT_EQ(found.sine[3].derivative, 2 * std::cos(0.7));
  EXPECT_EQ(found.cosine[3].derivative, -2 * std::sin(0.7));
}

}  // namespace
}  // namespace redysim
