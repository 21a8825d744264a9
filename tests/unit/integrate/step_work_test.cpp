#include "integrate/methods/step_work.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

// Work by quadrature of a power, in a step from 0 to 1 whose own work is useless.

namespace redysim {
namespace {

class StepWorks : public testing::Test {
 protected:
  StepWork step(double rtol) {
    StepWork work;
    work.start();
    work.begin(0);
    work.step(0, 1, 0, 1e9, rtol);
    return work;
  }
  StepWork::Power power(double (*of_time)(double)) {
    of_time_ = of_time;
    return {&StepWorks::evaluate, this, 0};
  }
  int evaluations = 0;

 private:
  static bool evaluate(double time, void* self, int, double& power) {
    ++static_cast<StepWorks*>(self)->evaluations;
    power = static_cast<StepWorks*>(self)->of_time_(time);
    return true;
  }
  double (*of_time_)(double) = nullptr;
};

// As of a contact that loops lock: force times the rounding errors of a velocity.
double noise(double time) {
  auto bits = static_cast<std::uint64_t>(time * 1e15) * 0x9e3779b97f4a7c15u;
  bits ^= bits >> 29;
  return 1e-14 * (static_cast<double>(bits % 1000003) / 1000003 - 0.5);
}

TEST_F(StepWorks, end_with_a_power_of_rounding_errors) {
  StepWork work = step(1e-10);
  EXPECT_LT(std::abs(work.end(power(&noise))), 1e-13);
  EXPECT_LT(evaluations, 2500);
}

TEST_F(StepWorks, do_not_resolve_what_rounding_hides) {
  StepWork work = step(1e-10);
  work.set_rounding(1e-14);
  work.end(power(&noise));
  EXPECT_EQ(evaluations, StepWork::nodes);
}

TEST_F(StepWorks, find_kinks_and_jumps) {
  StepWork kink = step(1e-12);
  EXPECT_NEAR(kink.end(power([](double t) { return std::abs(t - 0.3); })), 0.29, 1e-12);
  EXPECT_LT(evaluations, 800);
  StepWork jump = step(1e-12);
  EXPECT_NEAR(jump.end(power([](double t) { return t < 0.3 ? 1.0 : 2.0; })), 1.7, 1e-11);
}

TEST_F(StepWorks, agree_within_and_at_the_end_of_a_step) {
  const StepWork::Power of = power([](double t) { return std::cos(40 * t); });
  StepWork lazy = step(1e-10), whole = step(1e-10);
  for (double time : {0.1, 0.15, 0.7, 1.0}) EXPECT_NEAR(lazy.at(time, 0, of), std::sin(40 * time) / 40, 1e-8);
  EXPECT_EQ(lazy.end(of), whole.end(of));
}

}  // namespace
}  // namespace redysim
