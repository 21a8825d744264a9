#include <gtest/gtest.h>

#include <cmath>

#include "unit/integrate/rig.hpp"

namespace redysim {
namespace {

using test::Rig;
using test::solver;

constexpr SolverMethod erk = SolverMethod::erk;

// A tolerance that accepts any step, but chooses the method by rtol: steps of exactly max_step.
std::vector<double> with_fixed_steps(double rtol, double step) {
  SolverSettings settings = solver(erk, rtol, 10);
  settings.max_step = step;
  Rig rig("double_pendulum", settings);
  EXPECT_TRUE(rig.integrator->advance(1, true).ok);
  return rig.state();
}

double observed_order(double rtol, double step) {
  const std::vector<double> exact = with_fixed_steps(1e-12, 1.0 / 1024);
  const double coarse = test::largest_difference(with_fixed_steps(rtol, step), exact);
  const double fine = test::largest_difference(with_fixed_steps(rtol, step / 4), exact);
  return std::log(coarse / fine) / std::log(4.0);
}

TEST(Erk, order_is_three_at_loose_tolerance) { EXPECT_NEAR(observed_order(1e-3, 1.0 / 64), 3, 0.4); }
TEST(Erk, order_is_five_at_middle_tolerance) { EXPECT_NEAR(observed_order(1e-6, 1.0 / 32), 5, 0.5); }
// the leading error terms nearly cancel here at steps long enough to stand out of rounding
TEST(Erk, order_is_at_least_eight_at_tight_tolerance) { EXPECT_GT(observed_order(1e-12, 1.0 / 16), 7.6); }

// Right-hand sides of one-step advances, once the first step size is known.
double evaluations_per_advance(double rtol, bool inputs_changed) {
  Rig rig("double_pendulum", solver(erk, rtol));
  rig.integrator->advance(0.01, true);
  const Statistics before = rig.integrator->statistics();
  for (int k = 1; k <= 100; ++k) rig.integrator->advance(0.01 + k * 1e-4, inputs_changed);
  const Statistics after = rig.integrator->statistics();
  EXPECT_EQ(after.steps - before.steps, 100);
  return static_cast<double>(after.evaluations - before.evaluations) / 100;
}

TEST(Erk, step_costs_exactly_its_stages) {
  EXPECT_EQ(evaluations_per_advance(1e-3, true), 4);
  EXPECT_EQ(evaluations_per_advance(1e-6, true), 7);
  EXPECT_EQ(evaluations_per_advance(1e-12, true), 13);
}

TEST(Erk, last_slope_serves_the_next_step_when_inputs_stay) {
  EXPECT_EQ(evaluations_per_advance(1e-3, false), 3);
  EXPECT_EQ(evaluations_per_advance(1e-6, false), 6);
  EXPECT_EQ(evaluations_per_advance(1e-12, false), 13);
}

TEST(Erk, many_steps_cost_their_stages_too) {
  for (double rtol : {1e-6, 1e-11}) {
    Rig rig("double_pendulum", solver(erk, rtol));
    rig.integrator->advance(2, true);
    const Statistics& statistics = rig.integrator->statistics();
    const long tried = statistics.steps + statistics.rejected;
    // two for the first step's size, one of which is the first slope; then 6 new slopes a step, or 12 and
    // one at each new state but the last
    const long expected = rtol > 1e-9 ? 2 + 6 * tried : 2 + 12 * tried + (statistics.steps - 1);
    EXPECT_EQ(statistics.evaluations, expected);
  }
}

// A communication point right after a long step must not make the step after it small.
TEST(Erk, short_advances_do_not_spoil_the_step_size) {
  Rig smooth("double_pendulum", solver(erk)), cut("double_pendulum", solver(erk));
  smooth.integrator->advance(2, true);
  for (int k = 1; k <= 10; ++k) {
    cut.integrator->advance(k * 0.2 - 1e-7, false);
    cut.integrator->advance(k * 0.2, false);
  }
  EXPECT_LT(cut.integrator->statistics().steps, smooth.integrator->statistics().steps + 30);
}

}  // namespace
}  // namespace redysim
