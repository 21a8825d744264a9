#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "unit/integrate/rig.hpp"

namespace redysim {
namespace {

using test::Rig;

SolverSettings bounded(double rtol, double max_rhs, SolverMethod method = SolverMethod::automatic) {
  SolverSettings settings = test::solver(method, rtol);
  settings.max_rhs = max_rhs;
  return settings;
}

// Advances of `step` with inputs that change in one of three.
struct Course {
  long most = 0;  // right-hand sides of an advance
  long loosened = 0;
  double estimate = 0;  // the largest
  bool ok = true;
  std::vector<double> state;
};
Course run(const char* model, const SolverSettings& settings, double step, long pause = 0) {
  Rig rig(model, settings);
  Integrator& integrator = *rig.integrator;
  integrator.pause_after(pause);
  Course result;
  for (int k = 0; k < 60 && result.ok; ++k) {
    const bool changes = k % 3 == 0 && rig.system.nv() > 0;
    if (changes) rig.system.tau(0) = 1e-2 * (k % 7 - 3);
    const long before = integrator.statistics().evaluations;
    bool changed = changes;
    integrator.begin_communication_step();
    do {
      result.ok = integrator.advance((k + 1) * step, changed).ok;
      changed = false;
    } while (result.ok && integrator.time() < (k + 1) * step);
    result.most = std::max(result.most, integrator.statistics().evaluations - before);
    result.estimate = std::max(result.estimate, integrator.statistics().error_estimate);
  }
  result.loosened = integrator.statistics().loosened;
  result.state = rig.state();
  return result;
}

TEST(MaxRhs, no_advance_takes_more) {
  for (const char* model : {"double_pendulum", "kuka_kr5", "gripper", "four_bar", "stewart_platform", "top",
                            "pendulum_stops", "stick_slip", "bouncing_ball", "differential_wrist"})
    for (const double rtol : {1e-2, 1e-6, 1e-11})
      for (const int most : {8, 9, 13, 14, 25, 40})
        for (const double step : {1e-3, 1e-2}) {
          const Course bound = run(model, bounded(rtol, most), step);
          EXPECT_TRUE(bound.ok) << model << ' ' << rtol << ' ' << most << ' ' << step;
          EXPECT_LE(bound.most, most) << model << ' ' << rtol << ' ' << step;
          EXPECT_EQ(bound.loosened > 0, bound.estimate > 1) << model << ' ' << rtol << ' ' << most;
        }
}

TEST(MaxRhs, an_advance_interrupted_after_each_step_takes_as_many) {
  for (const int most : {9, 26}) {
    const Course whole = run("gripper", bounded(1e-9, most), 1e-2);
    const Course parts = run("gripper", bounded(1e-9, most), 1e-2, 1);
    EXPECT_LE(parts.most, most);
    EXPECT_GT(parts.loosened, 0);
    EXPECT_GT(whole.loosened, 0);
  }
}

// Errors shrink with what is allowed, down to that of the tolerance, and the estimate says so.
TEST(MaxRhs, more_right_hand_sides_are_less_error) {
  const std::vector<double> exact = run("gripper", test::solver(SolverMethod::erk, 1e-12), 0.01).state;
  double error[3], estimate[3];
  int k = 0;
  for (const int most : {8, 26, 400}) {
    const Course bound = run("gripper", bounded(1e-10, most), 0.01);
    error[k] = test::largest_difference(bound.state, exact);
    estimate[k++] = bound.estimate;
  }
  EXPECT_LT(error[1], 0.1 * error[0]);
  EXPECT_LT(error[2], 0.1 * error[1]);
  EXPECT_LT(error[2], 1e-8);
  EXPECT_GT(estimate[0], 100);
  EXPECT_GT(estimate[1], 1);
  EXPECT_LE(estimate[2], 1);
}

TEST(MaxRhs, a_bound_that_is_not_reached_changes_nothing) {
  const Course bound = run("kuka_kr5", bounded(1e-6, 1000, SolverMethod::erk), 1e-2);
  EXPECT_EQ(bound.loosened, 0);
  EXPECT_LT(bound.most, 100);
  EXPECT_EQ(bound.state, run("kuka_kr5", bounded(1e-6, 900), 1e-2).state);
}

// Of a stiff model no tolerance fits: the state grows without bound, which is an error.
TEST(MaxRhs, a_state_that_is_not_finite_is_a_failure) {
  EXPECT_FALSE(run("gripper_pd", bounded(1e-6, 8), 1e-2).ok);
}

}  // namespace
}  // namespace redysim
