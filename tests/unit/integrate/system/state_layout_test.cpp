#include "integrate/system/state_layout.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

namespace redysim {
namespace {

TEST(StateLayout, the_parts_follow_each_other_without_gaps) {
  const StateLayout layout(3, 2, 1, {2, 1, 3});
  EXPECT_EQ(layout.nq(), 3 + 2 * 4);
  EXPECT_EQ(layout.nv(), 3 + 2 * 3);
  EXPECT_EQ(layout.size(), layout.nq() + layout.nv() + layout.actuators() + 1);
  EXPECT_EQ(layout.actuators(), 2 + 2 + 1 + 3);
  std::vector<int> owners(static_cast<std::size_t>(layout.size()), 0);
  for (int i = 0; i < layout.size(); ++i)
    owners[i] = layout.q.contains(i) + layout.quaternion.contains(i) + layout.qd.contains(i) +
                layout.omega.contains(i) + layout.motor_q.contains(i) + layout.motor_qd.contains(i) +
                layout.current.contains(i) + layout.lagged.contains(i) + layout.work.contains(i);
  EXPECT_EQ(owners, std::vector<int>(owners.size(), 1));
}

TEST(StateLayout, entries_of_spherical_joints_are_found_by_joint_and_by_index) {
  const StateLayout layout(3, 2, false);
  std::vector<double> y(static_cast<std::size_t>(layout.size()));
  std::iota(y.begin(), y.end(), 0.0);
  EXPECT_EQ(*layout.quaternion.of(y.data(), 1), 3 + 4);
  EXPECT_EQ(*layout.omega.of(y.data(), 1), layout.nq() + 3 + 3);
  EXPECT_EQ(layout.omega.entry_at(layout.omega[1] + 2), 1);
  EXPECT_EQ(layout.work.count, 0);
}

}  // namespace
}  // namespace redysim
