#include "dynamics/loops/cluster_builder.hpp"

#include <gtest/gtest.h>

#include "dynamics/plan.hpp"
#include "support/mechanisms.hpp"

namespace redysim {
namespace {

TEST(Clusters, loops_along_a_tree_stay_apart) {
  const Plan<double> plan(test::four_bar_chain(3));
  ASSERT_EQ(plan.clusters.size(), 3u);
  for (int k = 0; k < 3; ++k) {
    const ClusterPlan& cluster = plan.clusters[static_cast<std::size_t>(k)];
    const int first = 3 * cluster.first_loop;
    EXPECT_EQ(cluster.root, cluster.first_loop == 0 ? ground : first - 1);
    EXPECT_EQ(cluster.loop_count, 1);
    EXPECT_EQ(cluster.joints, (std::vector<int>{first + 2, first + 1, first}));
  }
}

TEST(Clusters, loops_that_share_joints_are_one) {
  const Plan<double> plan(test::overlapping_loops(4));
  ASSERT_EQ(plan.clusters.size(), 1u);
  EXPECT_EQ(plan.clusters[0].loop_count, 4);
}

TEST(Clusters, every_joint_is_eliminated_once) {
  for (const Model& model :
       {test::four_bar_chain(3), test::overlapping_loops(4), test::serial_chain(5, false)}) {
    const Plan<double> plan(model);
    std::vector<int> times(plan.joints.size(), 0);
    for (const ClusterPlan& cluster : plan.clusters)
      for (int joint : cluster.joints) ++times[static_cast<std::size_t>(joint)];
    for (const EliminationStep& step : plan.elimination)
      if (step.kind == EliminationStep::Kind::joint) ++times[static_cast<std::size_t>(step.index)];
    if (plan.clusters.empty()) continue;
    EXPECT_EQ(times, std::vector<int>(plan.joints.size(), 1)) << model.name;
  }
}

}  // namespace
}  // namespace redysim
