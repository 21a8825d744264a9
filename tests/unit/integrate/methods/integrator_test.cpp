#include "integrate/methods/integrator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "support/allocation_count.hpp"
#include "unit/integrate/rig.hpp"

// What every method owes its caller.

namespace redysim {
namespace {

using test::Rig;
using test::solver;

class EveryMethod : public testing::TestWithParam<SolverMethod> {};

INSTANTIATE_TEST_SUITE_P(Methods, EveryMethod, test::every_method(), test::method_name);

std::vector<double> double_pendulum_after(double end, SolverMethod method, double rtol) {
  Rig rig("double_pendulum", solver(method, rtol));
  EXPECT_TRUE(rig.integrator->advance(end, true).ok);
  return rig.state();
}

TEST_P(EveryMethod, error_follows_the_tolerance) {
  const std::vector<double> exact = double_pendulum_after(1, SolverMethod::erk, 1e-12);
  double previous = 1;
  for (double rtol : {1e-3, 1e-5, 1e-7, 1e-9}) {
    const double error = test::largest_difference(double_pendulum_after(1, GetParam(), rtol), exact);
    EXPECT_LT(error, 500 * rtol);
    EXPECT_LT(error, 0.3 * previous);
    previous = error;
  }
}

TEST_P(EveryMethod, advance_ends_exactly_where_it_is_told) {
  Rig rig("double_pendulum", solver(GetParam()));
  for (double end : {1e-9, 1e-3, 0.1, 0.1 + 1e-15, 1.0 / 3, 2.0}) {
    EXPECT_TRUE(rig.integrator->advance(end, true).ok);
    EXPECT_EQ(rig.integrator->time(), end);
  }
}

TEST_P(EveryMethod, step_of_no_length_changes_nothing) {
  Rig rig("double_pendulum", solver(GetParam()));
  rig.integrator->advance(0.3, true);
  const std::vector<double> before = rig.state();
  EXPECT_TRUE(rig.integrator->advance(0.3, true).ok);
  EXPECT_EQ(rig.state(), before);
}

TEST_P(EveryMethod, step_backwards_or_to_nowhere_is_refused) {
  Rig rig("double_pendulum", solver(GetParam()));
  rig.integrator->advance(0.3, true);
  const std::vector<double> before = rig.state();
  for (double end :
       {0.2, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const Outcome outcome = rig.integrator->advance(end, false);
    EXPECT_FALSE(outcome.ok);
    EXPECT_FALSE(outcome.message.empty());
    EXPECT_EQ(rig.integrator->time(), 0.3);
    EXPECT_EQ(rig.state(), before);
  }
  EXPECT_TRUE(rig.integrator->advance(0.4, false).ok);
}

TEST_P(EveryMethod, starts_from_a_state_at_rest) {
  Rig rig("double_pendulum", solver(GetParam()));
  const std::vector<double> hanging = {-1.5707963267948966, 0, 0, 0};
  rig.integrator->start(0, hanging.data());
  EXPECT_TRUE(rig.integrator->advance(100, true).ok);
  EXPECT_LT(test::largest_difference(rig.state(), hanging), 1e-5);
}

TEST_P(EveryMethod, changed_input_takes_effect_at_its_time) {
  // torques that switch, against a tight run of the one-step method
  const auto run = [](SolverMethod method, double rtol) {
    Rig rig("kuka_kr5", solver(method, rtol));
    for (int k = 1; k <= 20; ++k) {
      for (int i = 0; i < 6; ++i) rig.system.tau(i) = (k + i) % 2 ? 3.0 : -2.0;
      EXPECT_TRUE(rig.integrator->advance(k * 0.01, true).ok);
    }
    return rig.state();
  };
  EXPECT_LT(test::largest_difference(run(GetParam(), 1e-8), run(SolverMethod::erk, 1e-12)), 1e-4);
}

TEST_P(EveryMethod, asking_for_the_work_does_not_change_the_motion) {
  Rig without("double_pendulum", solver(GetParam())), with("double_pendulum", solver(GetParam()), true);
  for (Rig* rig : {&without, &with}) {
    rig->system.tau(0) = 5;
    for (int k = 1; k <= 100; ++k) ASSERT_TRUE(rig->integrator->advance(k * 0.01, k == 1).ok);
  }
  std::vector<double> motion = with.state();
  motion.pop_back();
  EXPECT_EQ(motion, without.state());
  EXPECT_EQ(with.integrator->statistics().steps, without.integrator->statistics().steps);
}

TEST_P(EveryMethod, longest_step_is_honoured) {
  SolverSettings settings = solver(GetParam(), 1e-3);
  settings.max_step = 0.01;
  Rig rig("double_pendulum", settings);
  EXPECT_TRUE(rig.integrator->advance(1, true).ok);
  EXPECT_GE(rig.integrator->statistics().steps, 100);
  EXPECT_LE(rig.integrator->statistics().step_size, 0.01 * (1 + 1e-12));
}

TEST_P(EveryMethod, failure_keeps_the_last_good_state_and_prints_nothing) {
  Rig rig("double_pendulum", solver(GetParam()));
  ASSERT_TRUE(rig.integrator->advance(0.5, true).ok);
  const std::vector<double> before = rig.state();
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  for (double broken : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    rig.system.tau(1) = broken;
    const Outcome outcome = rig.integrator->advance(0.6, true);
    EXPECT_FALSE(outcome.ok);
    EXPECT_NE(outcome.message.find("t = 0.5"), std::string::npos) << outcome.message;
    EXPECT_EQ(rig.integrator->time(), 0.5);
    EXPECT_EQ(rig.state(), before);
  }
  EXPECT_EQ(testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr(), "");

  // usable again at once, and after a new start
  rig.system.tau(1) = 0;
  EXPECT_TRUE(rig.integrator->advance(0.6, true).ok);
  const std::vector<double> y = rig.start_state();
  EXPECT_TRUE(rig.integrator->start(0, y.data()).ok);
  EXPECT_TRUE(rig.integrator->advance(0.5, true).ok);
  EXPECT_EQ(rig.state(), before);
}

TEST_P(EveryMethod, start_refuses_a_state_that_is_not_finite) {
  Rig rig("pendulum", solver(GetParam()));
  const double y[] = {0, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_FALSE(rig.integrator->start(0, y).ok);
}

TEST_P(EveryMethod, start_forgets_everything) {
  Rig rig("double_pendulum", solver(GetParam()));
  rig.integrator->advance(0.7, true);
  const std::vector<double> first = rig.state();
  rig.integrator->advance(3, true);
  const std::vector<double> y = rig.start_state();
  rig.integrator->start(0, y.data());
  EXPECT_EQ(rig.integrator->statistics().steps, 0);
  rig.integrator->advance(0.7, false);
  EXPECT_EQ(rig.state(), first);
}

TEST_P(EveryMethod, successful_advance_does_not_allocate) {
  Rig rig("kuka_kr5", solver(GetParam()), true);
  const std::vector<double> y = rig.start_state();
  rig.integrator->start(0, y.data());
  long before = test::allocations;
  std::vector<unsigned char> saved;
  rig.integrator->save(saved);
  EXPECT_EQ(test::allocations > before, test::counts_allocations);
  before = test::allocations;
  bool ok = true;
  for (int k = 1; k <= 300; ++k) {
    rig.system.tau(0) = k / 100 == 1 ? (k % 7) : 0;
    ok = ok && rig.integrator->advance(k * 1e-3, k == 1 || k / 100 == 1).ok;
  }
  EXPECT_EQ(test::allocations - before, 0);
  EXPECT_TRUE(ok);
}

TEST_P(EveryMethod, two_integrators_do_not_know_of_each_other) {
  Rig alone("double_pendulum", solver(GetParam()));
  Rig one("double_pendulum", solver(GetParam())), other("kuka_kr5", solver(GetParam(), 1e-3));
  for (int k = 1; k <= 50; ++k) {
    alone.integrator->advance(k * 0.02, k == 1);
    one.integrator->advance(k * 0.02, k == 1);
    other.integrator->advance(k * 0.013, true);
  }
  EXPECT_EQ(one.state(), alone.state());
}

// Time goes on from a large start as from 0: where the ends are exact in both, bit for bit. `auto` weighs
// cost against time that is rounded, and may choose otherwise.
TEST_P(EveryMethod, late_start_is_no_other_run) {
  for (const char* model : {"double_pendulum", "four_bar", "stiff_arm"}) {
    Rig early(model, solver(GetParam())), late(model, solver(GetParam()));
    const std::vector<double> y = early.start_state();
    const double start = 0x1p30, step = 0x1p-10;
    late.integrator->start(start, y.data());
    for (int k = 1; k <= 100; ++k) {
      const bool changed = k == 1 || k % 10 == 0;
      early.system.tau(0) = late.system.tau(0) = k / 10;
      Outcome outcome = early.integrator->advance(k * step, changed);
      ASSERT_TRUE(outcome.ok) << model << ' ' << k << ": " << outcome.message;
      outcome = late.integrator->advance(start + k * step, changed);
      ASSERT_TRUE(outcome.ok) << model << ": " << outcome.message;
    }
    EXPECT_EQ(late.integrator->time(), start + 100 * step);
    if (GetParam() == SolverMethod::automatic)
      EXPECT_LT(test::largest_difference(late.state(), early.state()), 1e-4) << model;
    else
      EXPECT_EQ(late.state(), early.state()) << model;
  }
}

TEST_P(EveryMethod, late_start_ends_exactly_too) {
  Rig rig("stiff_arm", solver(GetParam()));
  const std::vector<double> y = rig.start_state();
  for (double start : {1e5, 1e7, 1e9, -1e9}) {
    rig.integrator->start(start, y.data());
    for (int k = 1; k <= 100; ++k) ASSERT_TRUE(rig.integrator->advance(start + k * 1e-3, true).ok) << start;
    EXPECT_EQ(rig.integrator->time(), start + 100 * 1e-3);
  }
}

// A motor that has turned for hours: the pendulum that swings after many turns is the one after none, up to
// the rounding of the angle.
TEST_P(EveryMethod, many_turns_leave_the_tolerance_alone) {
  constexpr long double turn = 6.283185307179586476925286766559L;
  const double offset = -0.6;
  for (double far : {1e4, 1e6, -1e6, 1e8}) {
    for (double rtol : {1e-6, 1e-8, 1e-10, 1e-12}) {
      Rig turned("pendulum", solver(GetParam(), rtol)), near("pendulum", solver(SolverMethod::erk, 1e-12));
      const double angle = far + offset;
      const auto start = static_cast<double>(std::remainder(static_cast<long double>(angle), turn));
      turned.integrator->start(0, std::vector<double>{angle, 0}.data());
      near.integrator->start(0, std::vector<double>{start, 0}.data());
      for (int k = 1; k <= 50; ++k) {
        turned.system.tau(0) = near.system.tau(0) = k / 10;
        const Outcome outcome = turned.integrator->advance(0.01 * k, k % 10 == 0);
        ASSERT_TRUE(outcome.ok) << far << ' ' << rtol << ": " << outcome.message;
        ASSERT_TRUE(near.integrator->advance(0.01 * k, k % 10 == 0).ok);
      }
      const double swung = turned.state()[0] - angle, rounding = 2e-16 * std::fabs(far);
      EXPECT_NEAR(swung, near.state()[0] - start, 100 * rtol + 2000 * rounding) << far << ' ' << rtol;
      EXPECT_NEAR(turned.state()[1], near.state()[1], 100 * rtol + 2000 * rounding) << far << ' ' << rtol;
      EXPECT_LT(turned.integrator->statistics().evaluations, 20000) << far << ' ' << rtol;
    }
  }
}

// A slide on a spring from a nanometre to a kilometre: absolute tolerances count in its own motion.
TEST_P(EveryMethod, size_of_a_mechanism_does_not_matter) {
  const SolverSettings settings = solver(GetParam(), 1e-7);
  for (double size : {1e-9, 1e-6, 1e-3, 1.0, 1e3}) {
    for (bool moving : {false, true}) {
      Model model = read_model_text(
                        "name = 'slide'\ngravity = [0, 0, 0]\n[[link]]\nname = 'cart'\njoint = 'prismatic'\n"
                        "mass = 2\ncom = [1, 0, 0]\nstiffness = 200\n",
                        "slide.toml")
                        .model;
      (moving ? model.links[0].joint.qd0 : model.links[0].joint.q0) = moving ? 10 * size : size;
      const Plan<double> plan(model);
      System system(plan, false, &model);
      const auto integrator = make_integrator(system, settings);
      const double y[] = {model.links[0].joint.q0, model.links[0].joint.qd0};
      integrator->start(0, y);
      for (int k = 1; k <= 100; ++k) {
        ASSERT_TRUE(integrator->advance(0.02 * k, k % 10 == 1).ok);
        const double phase = 10 * 0.02 * k, exact = moving ? std::sin(phase) : std::cos(phase);
        ASSERT_NEAR(integrator->state()[0] / size, exact, 3e-5) << size << ' ' << k;
      }
    }
  }
}

// Beyond hope, and told soon.
TEST_P(EveryMethod, end_that_is_years_of_computing_away_is_refused) {
  Rig rig("pendulum", solver(GetParam()));
  const std::vector<double> y = rig.start_state();
  rig.integrator->start(0, y.data());
  ASSERT_TRUE(rig.integrator->advance(0.5, true).ok);
  const Outcome outcome = rig.integrator->advance(1e15, false);
  EXPECT_FALSE(outcome.ok);
  EXPECT_NE(outcome.message.find("would not reach the end of the step"), std::string::npos)
      << outcome.message;
  EXPECT_LT(rig.integrator->statistics().steps, 450'000);
}

}  // namespace
}  // namespace redysim
