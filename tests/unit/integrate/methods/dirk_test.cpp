#include <gtest/gtest.h>

#include <cmath>

#include "model/read/model_file.hpp"
#include "unit/integrate/rig.hpp"

namespace redysim {
namespace {

using test::Rig;
using test::solver;

constexpr SolverMethod dirk = SolverMethod::dirk;

// By the tolerance, not by given steps: Newton's iteration is as exact as the tolerance asks for.
TEST(Dirk, order_is_at_least_four) { EXPECT_GT(test::observed_order(dirk, 1e-7, 1e-11), 3.8); }

// x'' = -(a + b) x' - a b (x - 1): both roots are real, and b is far beyond what explicit steps can follow.
struct Overdamped {
  double a, b;
  Model model;
  Plan<double> plan;
  System system;
  std::unique_ptr<Integrator> integrator;

  Overdamped(double slow, double fast, const SolverSettings& settings)
      : a(slow),
        b(fast),
        model(read_model_text(
                  "name = 'cart'\ngravity = [0, 0, 0]\n[[link]]\nname = 'mass'\njoint = 'prismatic'\n"
                  "mass = 1\nrest = 1\nstiffness = " +
                      std::to_string(a * b) + "\ndamping = " + std::to_string(a + b),
                  "cart.toml")
                  .model),
        plan(model),
        system(plan, false),
        integrator(make_integrator(system, settings)) {
    const double y[] = {0, 0};
    integrator->start(0, y);
  }
  double exact(double time) const {
    return 1 - (b * std::exp(-a * time) - a * std::exp(-b * time)) / (b - a);
  }
};

TEST(Dirk, follows_an_overdamped_oscillator_whatever_its_stiffness) {
  for (double fast : {1e3, 1e5, 1e7}) {
    for (double rtol : {1e-4, 1e-6, 1e-8}) {
      Overdamped cart(2, fast, solver(dirk, rtol));
      for (int k = 1; k <= 10; ++k) {
        ASSERT_TRUE(cart.integrator->advance(0.2 * k, k == 1).ok);
        EXPECT_NEAR(cart.integrator->state()[0], cart.exact(0.2 * k), 20 * rtol) << fast << " " << rtol;
      }
      // explicit steps would number at least fast * 2 s / 3.3
      EXPECT_LT(cart.integrator->statistics().steps, 60 * std::pow(1e-4 / rtol, 0.25)) << fast << " " << rtol;
    }
  }
}

// The stiff part of the state follows the slow part; the order must not fall to one there (Prothero, Robinson
// 1974): a tenfold smaller step has to pay even where hb is large.
TEST(Dirk, keeps_an_order_of_at_least_two_in_the_stiff_limit) {
  const auto error = [](double step) {
    SolverSettings settings = solver(dirk, 1e-3, 1e3);
    settings.max_step = step;
    Overdamped cart(2, 1e7, settings);
    const double on_slow_solution[] = {1 - std::exp(-0.0), 2.0};
    cart.integrator->start(0, on_slow_solution);
    EXPECT_TRUE(cart.integrator->advance(1, true).ok);
    return std::fabs(cart.integrator->state()[0] - (1 - std::exp(-2.0)));
  };
  EXPECT_GT(std::log10(error(0.1) / error(0.01)), 1.8);
}

TEST(Dirk, inputs_that_change_cost_no_more_than_one_slope_and_one_jacobian) {
  Rig rig("double_pendulum", solver(dirk));
  rig.integrator->advance(0.01, true);
  const Statistics before = rig.integrator->statistics();
  for (int k = 1; k <= 100; ++k) rig.integrator->advance(0.01 + k * 1e-4, true);
  const Statistics after = rig.integrator->statistics();
  EXPECT_EQ(after.steps - before.steps, 100);
  EXPECT_EQ(after.jacobians - before.jacobians, 100);
  // a slope, a jacobian and at most one iteration too many for each of six stages
  EXPECT_LE(after.evaluations - before.evaluations, 100 * (2 + 6 * 2));
}

}  // namespace
}  // namespace redysim
