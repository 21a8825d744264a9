#include <gtest/gtest.h>

#include "unit/integrate/rig.hpp"

namespace redysim {
namespace {

using test::Rig;
using test::solver;

class Multistep : public testing::TestWithParam<SolverMethod> {};

INSTANTIATE_TEST_SUITE_P(Cvode, Multistep, testing::Values(SolverMethod::adams, SolverMethod::bdf),
                         [](const auto& method) {
                           return method.param == SolverMethod::adams ? "adams" : "bdf";
                         });

TEST_P(Multistep, smooth_run_does_not_depend_on_where_it_is_cut) {
  Rig whole("double_pendulum", solver(GetParam())), cut("double_pendulum", solver(GetParam()));
  whole.integrator->advance(2, true);
  for (int k = 1; k <= 2000; ++k) ASSERT_TRUE(cut.integrator->advance(k == 2000 ? 2 : k * 1e-3, k == 1).ok);
  EXPECT_EQ(cut.state(), whole.state());
  EXPECT_EQ(cut.integrator->statistics().evaluations, whole.integrator->statistics().evaluations);
  EXPECT_EQ(cut.integrator->statistics().steps, whole.integrator->statistics().steps);
}

TEST_P(Multistep, work_does_not_depend_on_where_a_run_is_cut_or_restored) {
  Rig whole("kuka_kr5_computed_torque", solver(GetParam()), true);
  Rig cut("kuka_kr5_computed_torque", solver(GetParam()), true);
  Rig restored("kuka_kr5_computed_torque", solver(GetParam()), true);
  for (double end : {0.25, 0.5, 0.6})
    ASSERT_TRUE(advance(*whole.integrator, whole.system, end, end == 0.25).ok);
  for (int k = 1; k <= 60; ++k) {
    ASSERT_TRUE(advance(*cut.integrator, cut.system, k == 60 ? 0.6 : 0.01 * k, k == 1).ok);
    if (k != 43) continue;
    std::vector<unsigned char> bytes;
    cut.integrator->save(bytes);
    restored.system.inputs() = cut.system.inputs();
    ASSERT_TRUE(restored.integrator->restore(bytes.data(), bytes.size()));
  }
  ASSERT_TRUE(advance(*restored.integrator, restored.system, 0.6, false).ok);
  EXPECT_EQ(cut.state(), whole.state());
  EXPECT_EQ(restored.state(), whole.state());
  // some steps were too coarse for the work, which asks for more right-hand sides than the method itself
  const long extra = whole.system.evaluations() - whole.integrator->statistics().evaluations;
  EXPECT_GT(extra, 6);
  EXPECT_LT(extra, 4 * whole.integrator->statistics().evaluations);
}

TEST_P(Multistep, output_between_steps_is_as_accurate_as_at_their_ends) {
  Rig rig("double_pendulum", solver(GetParam(), 1e-7)),
      exact("double_pendulum", solver(SolverMethod::erk, 1e-12));
  for (int k = 1; k <= 300; ++k) {
    rig.integrator->advance(k * 3e-3, k == 1);
    exact.integrator->advance(k * 3e-3, k == 1);
    EXPECT_LT(test::largest_difference(rig.state(), exact.state()), 3e-5);
  }
}

TEST_P(Multistep, restart_by_itself_costs_little) {
  SolverSettings settings = solver(GetParam(), 1e-4);
  settings.max_step = 1e-3;
  Rig rig("pendulum", settings);
  rig.integrator->advance(1.9, true);  // below the first restart
  const Statistics first = rig.integrator->statistics();
  rig.integrator->advance(3.8, false);
  const Statistics second = rig.integrator->statistics();
  EXPECT_LT(static_cast<double>(second.evaluations - first.evaluations),
            1.02 * static_cast<double>(first.evaluations));
}

}  // namespace
}  // namespace redysim
