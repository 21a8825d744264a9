#include "integrate/methods/table_choice.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace redysim {
namespace {

constexpr double no_limit = std::numeric_limits<double>::max();

TableChoice::Situation open_tree(double remaining, double wanted, long steps) {
  return {remaining, wanted, no_limit, steps, 1, 6};
}

// The first decision sees how long the step is, the second that it stays.
double factor_of(TableChoice& choice, const TableChoice::Situation& now) {
  double factor = 0;
  choice.decide(now, factor);
  if (factor == 1) choice.decide(now, factor);
  return factor;
}

TEST(TableChoice, one_step_is_of_order_five_at_any_tolerance) {
  for (double rtol : {1e-4, 1e-8, 1e-12}) {
    TableChoice choice(rtol);
    EXPECT_EQ(factor_of(choice, open_tree(1e-3, 1e-2, 1)), 1);
    EXPECT_FALSE(choice.eighth());
  }
}

TEST(TableChoice, many_steps_are_of_order_eight_where_the_tolerance_is_tight) {
  TableChoice tight(1e-8), rough(1e-4);
  EXPECT_GT(factor_of(tight, open_tree(1, 1e-2, 1)), 2);
  EXPECT_TRUE(tight.eighth());
  EXPECT_EQ(factor_of(rough, open_tree(1, 1e-2, 1)), 1);
  EXPECT_FALSE(rough.eighth());
}

TEST(TableChoice, longest_step_takes_away_what_order_eight_gains) {
  TableChoice choice(1e-8);
  TableChoice::Situation limited = open_tree(1, 1e-2, 1);
  limited.step_limit = 1e-2;
  EXPECT_EQ(factor_of(choice, limited), 1);
}

TEST(TableChoice, returns_where_longer_steps_do_not_come_true) {
  TableChoice choice(1e-8);
  factor_of(choice, open_tree(1, 1e-2, 1));
  ASSERT_TRUE(choice.eighth());
  // its steps turn out no longer than those of order 5
  double factor = 1;
  for (long steps = 2; steps < 20 && choice.eighth(); ++steps)
    factor = factor_of(choice, open_tree(1, 1e-2, steps));
  EXPECT_FALSE(choice.eighth());
  EXPECT_LT(factor, 1);
}

TEST(TableChoice, near_corners_only_tight_tolerances_take_order_eight) {
  const auto is_eighth = [](double rtol, bool has_only_stops, double smooth_for) {
    TableChoice choice(rtol);
    TableChoice::Situation now = open_tree(1, 1e-2, 1);
    now.has_corners = true;
    now.has_only_stops = has_only_stops;
    now.smooth_for = smooth_for;
    factor_of(choice, now);
    return choice.eighth();
  };
  for (double smooth_for : {1e-2, 1.0, no_limit}) {
    EXPECT_TRUE(is_eighth(1e-10, false, smooth_for));
    EXPECT_FALSE(is_eighth(1e-8, false, smooth_for));
  }
  EXPECT_FALSE(is_eighth(1e-8, true, 0.1));
  EXPECT_TRUE(is_eighth(1e-8, true, 1));  // about 30 steps of order 8
}

TEST(TableChoice, waits_while_the_step_grows) {
  TableChoice choice(1e-8);
  double factor = 0;
  for (int k = 0; k < 10; ++k) {
    choice.decide(open_tree(1, 1e-9 * std::pow(6, k), k), factor);
    EXPECT_EQ(factor, 1);
  }
}

TEST(TableChoice, is_saved_and_restored_and_refuses_nonsense) {
  TableChoice choice(1e-8), other(1e-8);
  factor_of(choice, open_tree(1, 1e-2, 1));
  std::vector<unsigned char> bytes, again;
  ByteWriter writer(bytes);
  choice.put(writer);
  ByteReader reader(bytes.data(), bytes.size());
  ASSERT_TRUE(other.get(reader));
  EXPECT_TRUE(other.eighth());
  EXPECT_EQ(other.gain(), choice.gain());
  ByteWriter second(again);
  other.put(second);
  EXPECT_EQ(again, bytes);
  bytes.pop_back();
  ByteReader cut(bytes.data(), bytes.size());
  EXPECT_FALSE(other.get(cut));
}

}  // namespace
}  // namespace redysim
