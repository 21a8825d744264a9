#include "integrate/methods/step_budget.hpp"

#include <gtest/gtest.h>

namespace redysim {
namespace {

constexpr long interval = StepBudget::long_interval, short_interval = StepBudget::short_interval;

TEST(StepBudget, grows_with_the_length_of_the_advance_up_to_a_limit) {
  EXPECT_EQ(StepBudget(0, 0.1).steps(), 110'000);
  EXPECT_EQ(StepBudget(5, 7).steps(), 300'000);
  EXPECT_EQ(StepBudget(0, 1e9).steps(), 100'000'000);
}

TEST(StepBudget, an_end_out_of_reach_is_hopeless_after_one_interval) {
  StepBudget budget(0, 1e9);
  EXPECT_FALSE(budget.is_hopeless(short_interval - 1, 1, 1e9));
  EXPECT_TRUE(budget.is_hopeless(short_interval, 1, 1e9));
}

TEST(StepBudget, growing_steps_give_hope) {
  StepBudget budget(0, 1000);
  // 100 000 000 steps allow 1e-5 s each, or half of that if they may double
  EXPECT_FALSE(budget.is_hopeless(interval, 0.6e-5 * interval, 1000));
  // only the last interval counts
  EXPECT_TRUE(budget.is_hopeless(2 * interval, 0.61e-5 * interval, 1000));
}

TEST(StepBudget, a_small_budget_is_used_up) {
  StepBudget budget(0, 10);
  EXPECT_FALSE(budget.is_hopeless(interval, 0.003, 10));
}

TEST(StepBudget, steps_that_come_to_a_halt_are_hopeless) {
  // 1e9 steps to the end
  EXPECT_FALSE(StepBudget(0, 0.05).is_hopeless(short_interval, 0.51e-10 * short_interval, 0.05));
  EXPECT_TRUE(StepBudget(0, 0.05).is_hopeless(short_interval, 0.49e-10 * short_interval, 0.05));
}

}  // namespace
}  // namespace redysim
