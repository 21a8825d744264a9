#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "unit/integrate/rig.hpp"

namespace redysim {
namespace {

using test::Rig;
using test::solver;

class LoopsStayClosed : public testing::TestWithParam<SolverMethod> {};

INSTANTIATE_TEST_SUITE_P(Methods, LoopsStayClosed, test::every_method(), test::method_name);

double gap(Rig& rig) {
  std::vector<double> qdd(static_cast<std::size_t>(rig.plan.nv));
  rig.system.accelerations(0, rig.integrator->state(), qdd.data());
  double largest = 0;
  for (double residual : rig.system.workspace().loop.residual)
    largest = std::max(largest, std::fabs(residual));
  return largest;
}

double energy(Rig& rig) {
  return rig.system.kinetic_energy(rig.integrator->time(), rig.integrator->state()) +
         rig.system.potential_energy(rig.integrator->time(), rig.integrator->state());
}

TEST_P(LoopsStayClosed, at_every_output_and_with_the_energy_kept) {
  Rig rig("four_bar", solver(GetParam(), 1e-8));
  std::vector<double> y = rig.start_state();
  ASSERT_EQ(rig.system.project(0, y.data(), nullptr), Status::ok);
  rig.integrator->start(0, y.data());
  const double at_start = energy(rig);
  double largest_kinetic = 0;
  for (int k = 1; k <= 300; ++k) {
    const Outcome outcome = rig.integrator->advance(k * 0.01, k == 1);
    ASSERT_TRUE(outcome.ok) << outcome.message;
    EXPECT_LT(gap(rig), 1e-10) << k;
    largest_kinetic =
        std::max(largest_kinetic, rig.system.kinetic_energy(rig.integrator->time(), rig.integrator->state()));
    EXPECT_NEAR(energy(rig), at_start, 2e-5 * std::max(1.0, largest_kinetic)) << k;
  }
  // no method crawls
  EXPECT_LT(rig.integrator->statistics().evaluations,
            GetParam() == SolverMethod::exponential ? 60000 : 30000);
}

TEST_P(LoopsStayClosed, all_methods_find_the_same_motion) {
  const auto run = [](SolverMethod method, double rtol) {
    Rig rig("four_bar", solver(method, rtol));
    rig.system.tau(0) = 2;
    for (int k = 1; k <= 100; ++k) EXPECT_TRUE(rig.integrator->advance(k * 0.01, k == 1).ok);
    return rig.state();
  };
  EXPECT_LT(test::largest_difference(run(GetParam(), 1e-8), run(SolverMethod::erk, 1e-11)), 2e-5);
}

// Stages lie far from the closed configurations, where dependent rows become independent and would stop the
// mechanism.
void expect_errors_follow_the_tolerance(const char* model, SolverMethod method,
                                        const std::vector<int>& advances,
                                        const std::map<double, long>& most_evaluations) {
  Rig exact(model, solver(SolverMethod::adams, 1e-13));
  for (int k = 1; k <= 100; ++k) ASSERT_TRUE(exact.integrator->advance(k * 1e-2, k == 1).ok);
  for (const auto& [rtol, most] : most_evaluations)
    for (const int count : advances) {
      Rig rig(model, solver(method, rtol));
      for (int k = 1; k <= count; ++k)
        ASSERT_TRUE(rig.integrator->advance(static_cast<double>(k) / count, k == 1).ok);
      for (int k = 0; k < rig.system.nq(); ++k)
        EXPECT_NEAR(rig.state()[static_cast<std::size_t>(k)], exact.state()[static_cast<std::size_t>(k)],
                    20 * rtol)
            << model << ' ' << rtol << ' ' << count;
      EXPECT_LT(rig.integrator->statistics().evaluations, most) << model << ' ' << rtol << ' ' << count;
    }
}

TEST(OverconstrainedLoops, errors_follow_the_tolerance) {
  for (const char* model : {"bennett", "iftomm_bricard"}) {
    expect_errors_follow_the_tolerance(model, SolverMethod::erk, {2, 20, 100, 1000},
                                       {{1e-4, 500}, {1e-6, 500}, {1e-8, 800}, {1e-10, 1000}});
    expect_errors_follow_the_tolerance(model, SolverMethod::dirk, {2, 10},
                                       {{1e-4, 500}, {1e-6, 1000}, {1e-8, 2000}, {1e-10, 6000}});
  }
}

}  // namespace
}  // namespace redysim
