#include "dynamics/input_layout.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"

namespace redysim {
namespace {

TEST(InputLayout, spans_follow_each_other_without_gaps) {
  const InputLayout layout(Plan<double>(test::serial_chain(4, false)), 2, 1);
  EXPECT_EQ(layout.tau.begin, 0);
  EXPECT_EQ(layout.tau.size(), 4);
  EXPECT_EQ(layout.port_wrench.begin, layout.tau.end());
  EXPECT_EQ(layout.ball_torque.begin, layout.port_wrench.end());
  EXPECT_EQ(layout.held_motion.begin, layout.ball_torque.end());
  EXPECT_EQ(layout.held_motion.size(), 10);
  EXPECT_EQ(layout.phase.end(), layout.size());
  EXPECT_EQ(layout.size(), 4 + 10 + 1);
}

TEST(InputLayout, entries_and_indices_are_inverse) {
  const Span<5> span{7, 3};
  for (int entry = 0; entry < span.count; ++entry)
    for (int part = 0; part < 5; ++part) {
      EXPECT_TRUE(span.contains(span[entry] + part));
      EXPECT_EQ(span.entry_at(span[entry] + part), entry);
    }
  EXPECT_FALSE(span.contains(6));
  EXPECT_FALSE(span.contains(span.end()));
}

TEST(InputLayout, slopes_stand_behind_all_else) {
  const InputLayout layout(Plan<double>(test::serial_chain(4, false)));
  EXPECT_EQ(layout.slope_time(), layout.size());
  EXPECT_EQ(layout.slope(1, 0), layout.size() + 1);
  EXPECT_EQ(layout.slope(3, layout.force_size() - 1) + 1, layout.size_with_slopes());
}

}  // namespace
}  // namespace redysim
