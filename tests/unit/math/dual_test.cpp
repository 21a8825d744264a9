#include "math/dual.hpp"

#include <gtest/gtest.h>

namespace redysim {
namespace {

TEST(Dual, arithmetic_follows_the_product_and_quotient_rules) {
  const Dual x(3, 1);
  const Dual y = (x * x + 2 * x - 1) / (x - 5);
  EXPECT_DOUBLE_EQ(y.value, 14.0 / -2);
  EXPECT_DOUBLE_EQ(y.derivative, (8.0 * -2 - 14) / 4);
  EXPECT_DOUBLE_EQ((-y).derivative, -y.derivative);
}

TEST(Dual, functions_carry_their_derivatives) {
  const Dual x(0.7, 2);
  EXPECT_DOUBLE_EQ(sin(x).derivative, 2 * std::cos(0.7));
  EXPECT_DOUBLE_EQ(cos(x).derivative, -2 * std::sin(0.7));
  EXPECT_DOUBLE_EQ(sqrt(x).derivative, 2 * 0.5 / std::sqrt(0.7));
  EXPECT_DOUBLE_EQ(tanh(x).derivative, 2 / std::cosh(0.7) / std::cosh(0.7));
  EXPECT_DOUBLE_EQ(exp(x).derivative, 2 * std::exp(0.7));
  EXPECT_DOUBLE_EQ(abs(-x).derivative, 2);
}

TEST(Dual, comparisons_look_at_the_value_alone) {
  EXPECT_TRUE(Dual(1, 5) == Dual(1, 7));
  EXPECT_TRUE(Dual(1, 5) < Dual(2, 0));
  EXPECT_FALSE(Dual(1, 5) > 1);
}

}  // namespace
}  // namespace redysim
