#include "integrate/methods/explicit_steps.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "unit/integrate/rig.hpp"

namespace redysim {
namespace {

using test::Rig;
using test::solver;

constexpr double start = 0.6;

// y1' = 2 t y1 log y2, y2' = -2 t y2 log y1 has the solution exp(sin t^2), exp(cos t^2).
bool slope(double time, const double* y, double* slope, void*) {
  slope[0] = 2 * time * y[0] * std::log(y[1]);
  slope[1] = -2 * time * y[1] * std::log(y[0]);
  return true;
}
std::vector<double> solution(double time) {
  return {std::exp(std::sin(time * time)), std::exp(std::cos(time * time))};
}

// A step of h: its error at the end, and the largest one of the polynomial within.
std::pair<double, double> errors_of_step(double h) {
  ExplicitSteps method(2, &slope, nullptr);
  const std::vector<double> y = solution(start);
  std::vector<double> reached(2), within_step(2);
  slope(start, y.data(), method.first_slope(), nullptr);
  EXPECT_TRUE(method.step(start, h, y.data(), reached.data()));
  EXPECT_TRUE(method.fit(start, h));
  double within = 0;
  const auto at = [&](double share) {
    method.evaluate(share, within_step.data());
    return within_step;
  };
  for (int k = 1; k < 10; ++k)
    within = std::max(within, test::largest_difference(at(0.1 * k), solution(start + 0.1 * k * h)));
  EXPECT_LT(test::largest_difference(at(1), reached), 1e-15);
  EXPECT_EQ(at(0), solution(start));
  return {test::largest_difference(reached, solution(start + h)), within};
}

TEST(ExplicitSteps, local_errors_of_dop853_are_of_order_nine_and_eight) {
  const auto coarse = errors_of_step(0.2), fine = errors_of_step(0.1);
  EXPECT_NEAR(std::log2(coarse.first / fine.first), 9, 0.7);
  EXPECT_NEAR(std::log2(coarse.second / fine.second), 8, 0.7);
}

// At points that steps pass, the error is that of the tolerance.
double error_in_held_advances(const char* model, double rtol) {
  Rig rig(model, solver(SolverMethod::erk, rtol)), exact(model, solver(SolverMethod::adams, 1e-13));
  double error = 0;
  for (int k = 1; k <= 400; ++k) {
    EXPECT_TRUE(rig.integrator->advance(k * 1e-3, k == 1).ok);
    EXPECT_TRUE(exact.integrator->advance(k * 1e-3, k == 1).ok);
    EXPECT_EQ(rig.integrator->time(), k * 1e-3);
    error = std::max(error, test::largest_difference(rig.state(), exact.state()));
  }
  return error;
}

TEST(ExplicitSteps, states_between_steps_keep_the_tolerance) {
  for (const char* model : {"double_pendulum", "kuka_kr5", "gripper", "top", "leg", "slider_crank",
                            "stewart_platform", "cognate"})
    for (const double rtol : {1e-5, 1e-8, 1e-11})
      EXPECT_LT(error_in_held_advances(model, rtol), 100 * rtol) << model << rtol;
}

// Advances between which the torque changes, as if no step had passed their ends.
TEST(ExplicitSteps, steps_that_passed_a_change_of_the_inputs_are_forgotten) {
  Rig rig("double_pendulum", solver(SolverMethod::erk, 1e-9));
  Rig exact("double_pendulum", solver(SolverMethod::adams, 1e-13));
  for (int k = 1; k <= 300; ++k) {
    const bool changes = k % 25 == 0 || k % 70 == 0;
    for (Rig* each : {&rig, &exact}) {
      if (changes) each->system.tau(0) = 0.01 * k;
      ASSERT_TRUE(each->integrator->advance(k * 1e-3, k == 1 || changes).ok);
    }
    EXPECT_LT(test::largest_difference(rig.state(), exact.state()), 1e-7) << k;
  }
}

TEST(ExplicitSteps, loops_are_closed_where_a_step_passes_the_end_of_an_advance) {
  Rig rig("three_rrr", solver(SolverMethod::erk, 1e-4));
  for (int k = 1; k <= 200; ++k) {
    ASSERT_TRUE(rig.integrator->advance(k * 1e-3, k == 1).ok);
    std::vector<double> closed = rig.state();
    ASSERT_EQ(rig.system.project(k * 1e-3, closed.data(), nullptr), Status::ok);
    EXPECT_LT(test::largest_difference(rig.state(), closed), 1e-13) << k;
  }
  EXPECT_LT(rig.integrator->statistics().steps, 50);
}

void continues_bit_for_bit(const char* model) {
  Rig rig(model, solver(SolverMethod::erk, 1e-8)), other(model, solver(SolverMethod::erk, 1e-8));
  for (int k = 1; k <= 55; ++k) ASSERT_TRUE(rig.integrator->advance(k * 1e-3, k == 1).ok);
  std::vector<unsigned char> bytes;
  rig.integrator->save(bytes);
  ASSERT_TRUE(other.integrator->restore(bytes.data(), bytes.size()));
  for (int k = 56; k <= 120; ++k) {
    ASSERT_TRUE(rig.integrator->advance(k * 1e-3, k == 80).ok);
    ASSERT_TRUE(other.integrator->advance(k * 1e-3, k == 80).ok);
    EXPECT_EQ(rig.state(), other.state());
  }
  const std::size_t size = bytes.size();
  for (std::size_t cut = 1; cut < size; cut += 37)
    EXPECT_FALSE(other.integrator->restore(bytes.data(), size - cut));
}

TEST(ExplicitSteps, a_state_saved_within_a_step_continues_bit_for_bit) {
  for (const char* model : {"double_pendulum", "four_bar", "bennett"}) continues_bit_for_bit(model);
}

}  // namespace
}  // namespace redysim
