#include "math/tape.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "math/recorded.hpp"

namespace redysim {
namespace {

using Operation = Tape::Operation;

struct TapeTest : testing::Test {
  Tape tape;
  int x = tape.symbol("x"), y = tape.symbol("y"), zero = tape.constant(0), one = tape.constant(1);
};

TEST_F(TapeTest, constants_are_folded) {
  EXPECT_TRUE(tape.is_constant(tape.apply(Operation::add, tape.constant(2), tape.constant(3)), 5));
  EXPECT_TRUE(tape.is_constant(tape.apply(Operation::divide, tape.constant(1), tape.constant(4)), 0.25));
  EXPECT_EQ(tape.constant(-0.0), zero);
}

TEST_F(TapeTest, neutral_operations_vanish) {
  const int size = tape.size();
  EXPECT_EQ(tape.apply(Operation::add, x, zero), x);
  EXPECT_EQ(tape.apply(Operation::subtract, x, zero), x);
  EXPECT_EQ(tape.apply(Operation::multiply, one, x), x);
  EXPECT_EQ(tape.apply(Operation::divide, x, one), x);
  EXPECT_EQ(tape.apply(Operation::multiply, x, zero), zero);
  EXPECT_EQ(tape.apply(Operation::subtract, x, x), zero);
  EXPECT_EQ(tape.size(), size);
}

TEST_F(TapeTest, signs_are_gathered) {
  const int minus_x = tape.apply(Operation::multiply, tape.constant(-1), x);
  EXPECT_EQ(tape[minus_x].operation, Operation::negate);
  EXPECT_EQ(tape.apply(Operation::subtract, zero, minus_x), x);
  EXPECT_EQ(tape.apply(Operation::add, y, minus_x), tape.apply(Operation::subtract, y, x));
  EXPECT_EQ(tape.apply(Operation::subtract, zero, tape.apply(Operation::subtract, x, y)),
            tape.apply(Operation::subtract, y, x));
}

TEST_F(TapeTest, nothing_stands_twice) {
  EXPECT_EQ(tape.symbol("x"), x);
  EXPECT_EQ(tape.apply(Operation::multiply, x, y), tape.apply(Operation::multiply, y, x));
  EXPECT_NE(tape.apply(Operation::divide, x, y), tape.apply(Operation::divide, y, x));
  EXPECT_EQ(tape.function("sin", x), tape.function("sin", x));
}

TEST_F(TapeTest, only_what_results_need_is_kept) {
  const int product = tape.apply(Operation::multiply, x, y), sine = tape.function("sin", x);
  const std::vector<char> needed = tape.needed_by({sine});
  EXPECT_TRUE(needed[static_cast<std::size_t>(sine)] && needed[static_cast<std::size_t>(x)]);
  EXPECT_FALSE(needed[static_cast<std::size_t>(product)] || needed[static_cast<std::size_t>(y)]);
  EXPECT_EQ(tape.operations_for({sine}), std::vector<int>{sine});
}

TEST_F(TapeTest, recorded_numbers_branch_on_constants_only) {
  const Recorded a(tape, x), difference = a - a;
  EXPECT_TRUE(difference == 0.0);
  EXPECT_TRUE(Recorded(1) < Recorded(2));
  EXPECT_THROW(static_cast<void>(a < 2.0), std::domain_error);
  EXPECT_EQ((a * 3.0 + 0.0).node_on(tape), (3.0 * a).node_on(tape));
}

}  // namespace
}  // namespace redysim
