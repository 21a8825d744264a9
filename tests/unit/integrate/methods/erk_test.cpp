#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "integrate/methods/explicit_tables.hpp"
#include "model/read/model_file.hpp"
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

TEST(Erk, order_is_three_at_loose_tolerance) { EXPECT_NEAR(observed_order(1e-2, 1.0 / 64), 3, 0.4); }
TEST(Erk, order_is_five_at_middle_tolerance) { EXPECT_NEAR(observed_order(1e-6, 1.0 / 32), 5, 0.5); }

// At steps free to grow, right-hand sides ~ tolerance^(-1/order of the error estimate).
TEST(Erk, order_is_eight_in_a_long_advance) {
  const auto evaluations = [](double rtol) {
    Rig rig("double_pendulum", solver(erk, rtol));
    EXPECT_TRUE(rig.integrator->advance(5, true).ok);
    return static_cast<double>(rig.integrator->statistics().evaluations);
  };
  const double growth = std::log10(evaluations(1e-11) / evaluations(1e-8)) / 3;
  EXPECT_GT(1 / growth, 6.5);
}

// Of `order` and of the embedded method, one order below; rows sum to the times.
template <int last>
void expect_quadrature_conditions(const EmbeddedPair<last>& pair, int order) {
  const double* step = pair.rows + last * (last - 1) / 2;
  for (int power = 0; power < order; ++power) {
    double sum = 0, error = 0;
    for (int k = 0; k <= last; ++k) {
      if (k < last) sum += step[k] * std::pow(pair.times[k], power);
      error += pair.error[k] * std::pow(pair.times[k], power);
    }
    EXPECT_NEAR(sum, 1.0 / (power + 1), 1e-13);
    if (power + 1 < order) {
      EXPECT_NEAR(error, 0, 1e-13);
    }
  }
  for (int k = 1; k <= last; ++k) {
    const double* row = pair.rows + k * (k - 1) / 2;
    EXPECT_NEAR(std::accumulate(row, row + k, 0.0), pair.times[k], 1e-13);
  }
}

TEST(Erk, tables_meet_their_quadrature_conditions) {
  expect_quadrature_conditions(bogacki_shampine_rows, 3);
  expect_quadrature_conditions(dormand_prince_rows, 5);
}

// Right-hand sides of one-step advances, once the first step size is known.
double evaluations_per_advance(double rtol, bool inputs_changed) {
  Rig rig("double_pendulum", solver(erk, rtol));
  rig.integrator->advance(0.01, true);
  const long before = rig.integrator->statistics().evaluations;
  for (int k = 1; k <= 100; ++k) rig.integrator->advance(0.01 + k * 1e-4, inputs_changed);
  return static_cast<double>(rig.integrator->statistics().evaluations - before) / 100;
}

TEST(Erk, step_costs_exactly_its_stages) {
  EXPECT_EQ(evaluations_per_advance(1e-2, true), 4);
  EXPECT_EQ(evaluations_per_advance(1e-6, true), 7);
  EXPECT_EQ(evaluations_per_advance(1e-10, true), 7);
}

TEST(Erk, a_step_of_order_eight_serves_many_advances_when_inputs_stay) {
  for (const double rtol : {1e-2, 1e-4, 1e-6, 1e-10})
    EXPECT_LT(evaluations_per_advance(rtol, false), 0.5) << rtol;
}

// Up to an impact a step serves many advances; over it, the error estimate of order 8 would be too small.
TEST(Erk, steps_pass_advances_up_to_a_stop) {
  Rig rig("pendulum_stops", solver(erk, 1e-8)), exact("pendulum_stops", solver(SolverMethod::adams, 1e-12));
  int k = 0;
  while (rig.integrator->state()[0] > rig.plan.resistances[0].lower && k < 10000)
    rig.integrator->advance(++k * 1e-3, false);
  ASSERT_GT(k, 100);
  EXPECT_LT(rig.integrator->statistics().evaluations, 2 * k);
  for (const int last = k + 300; k < last;) rig.integrator->advance(++k * 1e-3, false);
  exact.integrator->advance(k * 1e-3, false);
  EXPECT_LT(test::largest_difference(rig.state(), exact.state()), 5e-7);
}

// Dry friction turns around within 10 mrad/s.
TEST(Erk, steps_pass_advances_between_reversals) {
  const std::string joint =
      "alpha = 1.5707963267948966\nmass = 1\ncom = [0.5, 0, 0]\ninertia = [0.1, 0.1, 0.1]\n"
      "friction = 0.05\nfriction_velocity = 0.01\n";
  const Model model =
      read_model_text("name = 'pendulum'\n[[link]]\nname = 'one'\n" + joint, "pendulum.toml").model;
  const Plan<double> plan(model);
  const auto run = [&](SolverMethod method, double rtol, Statistics& statistics) {
    System system(plan, false);
    const auto integrator = make_integrator(system, solver(method, rtol));
    const double y[] = {0, 0};
    integrator->start(0, y);
    for (int k = 1; k <= 3000; ++k) EXPECT_TRUE(integrator->advance(k * 1e-3, false).ok);
    statistics = integrator->statistics();
    return std::vector<double>(integrator->state(), integrator->state() + 2);
  };
  Statistics statistics, of_exact;
  const std::vector<double> state = run(erk, 1e-6, statistics),
                            exact = run(SolverMethod::adams, 1e-12, of_exact);
  EXPECT_LT(test::largest_difference(state, exact), 1e-5);
  EXPECT_LT(statistics.evaluations, 3000);
  EXPECT_LT(statistics.rejected, statistics.steps / 4);
}

// Torques that change in every second advance: a step beyond that would be lost. In the others the last slope
// serves the next step.
TEST(Erk, no_step_passes_an_expected_change_of_the_inputs) {
  Rig rig("double_pendulum", solver(erk, 1e-6));
  for (int k = 1; k <= 20; ++k) rig.integrator->advance(k * 1e-4, k % 2 == 0);
  const Statistics before = rig.integrator->statistics();
  for (int k = 21; k <= 120; ++k) rig.integrator->advance(k * 1e-4, k % 2 == 0);
  const Statistics after = rig.integrator->statistics();
  EXPECT_EQ(after.steps - before.steps, 100);
  EXPECT_EQ(after.evaluations - before.evaluations, 50 * 7 + 50 * 6);
}

// What a step of low order leaves open costs more to close than the slopes that it saves.
TEST(Erk, loose_tolerances_take_order_five_where_there_are_loops) {
  const auto error = [](double rtol) {
    Rig loose("four_bar", solver(erk, rtol)), exact("four_bar", solver(erk, 1e-12));
    for (int k = 1; k <= 50; ++k) {
      EXPECT_TRUE(loose.integrator->advance(k * 0.01, true).ok);
      EXPECT_TRUE(exact.integrator->advance(k * 0.01, false).ok);
    }
    EXPECT_LE(loose.integrator->statistics().steps, 60);
    return test::largest_difference(loose.state(), exact.state());
  };
  EXPECT_LT(error(0.1), 1e-3);
}

TEST(Erk, many_steps_cost_their_stages_too) {
  Rig rig("double_pendulum", solver(erk, 1e-4));  // order 5 all the way
  rig.integrator->advance(2, true);
  const Statistics& statistics = rig.integrator->statistics();
  // two for the first step's size, one of which is the first slope
  EXPECT_EQ(statistics.evaluations, 2 + 6 * (statistics.steps + statistics.rejected));
}

// Right-hand sides and error of `advances` in 1 s, torques as they are or changed each time.
std::pair<double, double> work_and_error(double rtol, int advances, bool changing) {
  const auto run = [&](double tolerance, double& work) {
    Rig rig("kuka_kr5", solver(erk, tolerance));
    for (int k = 1; k <= advances; ++k) {
      rig.system.tau(1) = changing ? (k % 2 ? 20 : -20) : 0;
      EXPECT_TRUE(rig.integrator->advance(static_cast<double>(k) / advances, changing || k == 1).ok);
    }
    work = static_cast<double>(rig.integrator->statistics().evaluations);
    return rig.state();
  };
  double work = 0, unused = 0;
  const std::vector<double> state = run(rtol, work);
  return {work, test::largest_difference(state, run(1e-13, unused))};
}

TEST(Erk, long_advances_gain_by_order_eight_and_short_ones_cost_order_five) {
  const auto [short_work, short_error] = work_and_error(1e-9, 1000, true);
  EXPECT_LT(short_work, 7200);
  EXPECT_LT(short_error, 1e-7);
  // order 5 alone takes 1268 and 1934 in 0.1 s
  const auto [long_work, long_error] = work_and_error(1e-9, 10, false);
  EXPECT_LT(long_work, 1500);
  EXPECT_LT(long_error, 1e-6);
}

TEST(Erk, long_advance_that_fails_late_leaves_the_state_where_it_began) {
  SolverSettings settings = solver(erk, 1e-8);
  settings.max_step = 1e-6;  // 100 100 steps end long before 1 s
  Rig rig("double_pendulum", settings);
  ASSERT_TRUE(rig.integrator->advance(1e-3, true).ok);
  const std::vector<double> before = rig.state();
  EXPECT_FALSE(rig.integrator->advance(1, false).ok);
  EXPECT_EQ(rig.integrator->time(), 1e-3);
  EXPECT_EQ(rig.state(), before);
}

TEST(Erk, energy_of_a_pendulum_stays_for_hours) {
  Rig rig("pendulum", solver(erk, 1e-8));
  const double start = rig.system.potential_energy(0, rig.integrator->state());
  double moving = 0;
  for (int k = 1; k <= 100; ++k) {
    ASSERT_TRUE(rig.integrator->advance(100.0 * k, k == 1).ok);
    moving = std::max(moving, rig.system.kinetic_energy(100.0 * k, rig.integrator->state()));
  }
  const double* y = rig.integrator->state();
  EXPECT_LT(std::fabs(rig.system.kinetic_energy(1e4, y) + rig.system.potential_energy(1e4, y) - start),
            1e-4 * moving);
}

// A communication point right after a long step must not make the step after it small.
TEST(Erk, short_advances_do_not_spoil_the_step_size) {
  Rig smooth("double_pendulum", solver(erk)), cut("double_pendulum", solver(erk));
  smooth.integrator->advance(2, true);
  for (int k = 1; k <= 10; ++k) {
    cut.integrator->advance(k * 0.2 - 1e-7, false);
    cut.integrator->advance(k * 0.2, false);
  }
  // each of the 20 advances may cost a step more
  EXPECT_LT(cut.integrator->statistics().evaluations, smooth.integrator->statistics().evaluations + 20 * 7);
}

}  // namespace
}  // namespace redysim
