#include "integrate/methods/step_control.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace redysim {
namespace {

TEST(StepControl, error_below_tolerance_lengthens_the_step_and_above_shortens_it) {
  StepControl control(5, 0);
  control.start(0.1);
  control.accepted(0.1, 1e-3);
  EXPECT_GT(control.wanted(), 0.1);
  const double wanted = control.wanted();
  EXPECT_LT(control.rejected(wanted, 20), wanted);
}

TEST(StepControl, short_last_step_does_not_shorten_the_next) {
  StepControl control(5, 0);
  control.start(0.1);
  control.accepted(1e-4, 0);  // cut short: its error says nothing
  EXPECT_GE(control.wanted(), 0.1);
}

TEST(StepControl, no_error_at_all_does_not_let_the_step_grow_without_bound) {
  StepControl control(5, 0);
  control.start(0.1);
  for (int k = 0; k < 50; ++k) control.accepted(1e-3, 0);
  EXPECT_LE(control.wanted(), 0.1);
}

TEST(StepControl, rest_of_the_way_is_cut_into_equal_parts) {
  StepControl control(5, 0);
  control.start(0.7);
  EXPECT_DOUBLE_EQ(control.step_for(1.0), 0.5);
  EXPECT_DOUBLE_EQ(control.step_for(0.7), 0.7);
  EXPECT_DOUBLE_EQ(control.step_for(0.3), 0.3);
}

TEST(StepControl, longest_step_is_honoured) {
  StepControl control(5, 0.25);
  control.start(1);
  EXPECT_LE(control.step_for(1.0), 0.25);
  control.accepted(0.25, 1e-8);
  EXPECT_LE(control.step_for(10.0), 0.25);
}

TEST(StepControl, failed_right_hand_side_shortens_the_step) {
  StepControl control(5, 0);
  control.start(1);
  EXPECT_LT(control.rejected(1, std::numeric_limits<double>::quiet_NaN()), 0.5);
  EXPECT_LT(control.rejected(1, std::numeric_limits<double>::infinity()), 0.5);
}

}  // namespace
}  // namespace redysim
