#include <gtest/gtest.h>

#include <cmath>

#include "dynamics/straight_line/taylor_series.hpp"
#include "integrate/methods/methods.hpp"
#include "support/evaluate.hpp"
#include "unit/integrate/rig.hpp"

// Method taylor with the recursion that was written for branched_arm.toml, against the recursions over the
// joints and against ARKODE.

namespace redysim {
namespace {

using test::largest_difference;
using test::Rig;
using test::solver;

constexpr const char* scene = "branched_arm";

struct Motion : Rig {
  explicit Motion(double rtol, SolverMethod method = SolverMethod::taylor)
      : Rig(scene, solver(method == SolverMethod::taylor ? SolverMethod::erk : method, rtol), true) {
    if (method != SolverMethod::taylor) return;
    integrator = make_taylor(system, solver(method, rtol));
    integrator->start(0, start_state().data());
  }
  void hold(const std::vector<double>& forces) {
    for (int i = 0; i < plan.nv; ++i) system.tau(i) = forces[static_cast<std::size_t>(i)];
  }
  bool go(double end, bool inputs_changed = false) { return integrator->advance(end, inputs_changed).ok; }
  long evaluations() const { return integrator->statistics().evaluations; }
};

std::vector<double> forces_at(int step) {
  std::vector<double> forces;
  for (int i = 0; i < 5; ++i) forces.push_back((i == 3 ? 0.05 : 1) * std::sin(1.7 * step + i));
  return forces;
}

TEST(TaylorSeries, satisfies_the_equations_of_motion) {
  Motion run(1e-9);
  test::Evaluate<double> recursion(run.model);
  const int n = run.plan.nv;
  std::vector<double> state = run.start_state(), slope(state), at(state),
                      none(static_cast<std::size_t>(n), 0.0);
  TaylorSeries series(run.plan, run.system.size(), 20);
  for (const double unit : {0.002, 1.0}) {
    ASSERT_TRUE(series.set_slope(state.data(), forces_at(1).data()));
    series.start(state.data(), unit);
    // forces that grow with time
    const std::vector<double> growth = forces_at(2);
    std::vector<double> first(growth);
    for (double& force : first) force *= unit;
    while (series.order() < 20) series.extend(series.order() == 1 ? first.data() : none.data());
    for (const double time : {0.0, 5e-4, 1e-3}) {
      series.evaluate(time, at.data(), slope.data());
      const auto q = test::vector_of({at.begin(), at.begin() + n});
      const auto qd = test::vector_of({at.begin() + n, at.begin() + 2 * n});
      const test::Vector forces = test::vector_of(forces_at(1)) + time * test::vector_of(growth);
      const test::Vector qdd = recursion.qdd(q, qd, forces);
      for (int i = 0; i < n; ++i) {
        EXPECT_NEAR(slope[static_cast<std::size_t>(i)], qd[i], 1e-11);
        EXPECT_NEAR(slope[static_cast<std::size_t>(n + i)], qdd[i], 1e-10);
      }
      EXPECT_NEAR(slope.back(), recursion.power(q, qd, forces), 1e-11);
    }
  }
}

TEST(Taylor, error_follows_the_tolerance) {
  Motion exact(1e-13, SolverMethod::erk);
  ASSERT_TRUE(exact.go(1, true));
  double before = 1;
  for (const double rtol : {1e-4, 1e-6, 1e-8, 1e-10}) {
    Motion run(rtol);
    ASSERT_TRUE(run.go(1, true));
    const double error = largest_difference(run.state(), exact.state());
    EXPECT_LT(error, 20 * rtol);
    EXPECT_LT(error, 0.2 * before);
    before = error;
  }
}

TEST(Taylor, follows_inputs_that_change_and_grow) {
  Motion run(1e-10), exact(1e-13, SolverMethod::erk);
  for (Motion* one : {&run, &exact}) {
    for (int step = 0; step < 50; ++step) {
      one->hold(forces_at(step));
      ASSERT_TRUE(one->go(0.002 * (step + 1), true));
    }
    for (int order = 1; order <= InputLayout::highest_order; ++order)
      one->system.set_input_slope(0.1, one->system.input_layout().tau[1], order, 3.0 * order);
    ASSERT_TRUE(one->go(0.15, true));
    ASSERT_TRUE(one->go(0.5, false));
  }
  EXPECT_LT(largest_difference(run.state(), exact.state()), 1e-9);
}

TEST(Taylor, one_series_serves_many_steps) {
  Motion cut(1e-8), whole(1e-8), exact(1e-13, SolverMethod::erk);
  ASSERT_TRUE(whole.go(1, true) && exact.go(1, true));
  for (int k = 1; k <= 1000; ++k) ASSERT_TRUE(cut.go(k == 1000 ? 1 : 0.001 * k, k == 1));
  EXPECT_LT(cut.evaluations(), 1.3 * static_cast<double>(whole.evaluations()));
  EXPECT_LT(largest_difference(cut.state(), exact.state()), 1e-7);
}

TEST(Taylor, orders_suffice_for_the_time_until_inputs_change) {
  Motion run(1e-6);
  for (int step = 0; step < 200; ++step) {
    run.hold(forces_at(step));
    ASSERT_TRUE(run.go(0.001 * (step + 1), true));
  }
  EXPECT_LT(run.evaluations(), 8 * 200);
}

TEST(Taylor, continues_from_saved_bytes_bit_for_bit) {
  for (const int changed_after : {1, 7}) {
    Motion run(1e-8), other(1e-8);
    run.hold(forces_at(0));
    for (int k = 1; k <= 10; ++k) ASSERT_TRUE(run.go(0.003 * k, k == 1 || k == changed_after));
    std::vector<unsigned char> bytes, later, same;
    run.integrator->save(bytes);
    other.hold(forces_at(0));
    ASSERT_TRUE(other.integrator->restore(bytes.data(), bytes.size()));
    EXPECT_FALSE(other.integrator->restore(bytes.data(), bytes.size() - 1));
    for (Motion* one : {&run, &other})
      for (int k = 11; k <= 60; ++k) ASSERT_TRUE(one->go(0.003 * k, false));
    run.integrator->save(later);
    other.integrator->save(same);
    EXPECT_EQ(later, same);
  }
}

TEST(Taylor, ends_with_a_sentence_where_it_cannot_go_on) {
  Motion run(1e-6);
  run.system.tau(0) = std::nan("");
  Outcome outcome = run.integrator->advance(0.1, true);
  EXPECT_NE(outcome.message.find("accelerations are not finite"), std::string::npos) << outcome.message;
  EXPECT_EQ(run.integrator->time(), 0);
  run.system.tau(0) = 1e200;
  outcome = run.integrator->advance(0.1, true);
  EXPECT_FALSE(outcome.ok);
  run.system.tau(0) = 0;
  EXPECT_TRUE(run.go(0.1, true));
  EXPECT_FALSE(run.go(0.05));
}

TEST(Taylor, pauses_after_steps) {
  Motion run(1e-8), whole(1e-8);
  ASSERT_TRUE(whole.go(1, true));
  run.integrator->pause_after(1);
  int calls = 0;
  while (run.integrator->time() < 1 && calls++ < 1000) ASSERT_TRUE(run.go(1, calls == 1));
  EXPECT_EQ(run.state(), whole.state());
  EXPECT_GT(calls, 3);
}

TEST(Taylor, rests_where_nothing_moves) {
  Motion run(1e-6);
  run.plan.gravity.setZero();
  std::vector<double> y(run.start_state().size(), 0.0);
  y[1] = 0.2;  // the springs are relaxed
  run.integrator->start(0, y.data());
  ASSERT_TRUE(run.go(1e4, true));
  EXPECT_LT(largest_difference(run.state(), y), 1e-12);
  run.hold(forces_at(0));
  ASSERT_TRUE(run.go(1e4 + 0.01, true));
  EXPECT_GT(largest_difference(run.state(), y), 1e-4);
}

}  // namespace
}  // namespace redysim
