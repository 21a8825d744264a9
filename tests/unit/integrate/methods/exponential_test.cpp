#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "integrate/methods/phi_functions.hpp"
#include "model/read/model_file.hpp"
#include "unit/integrate/rig.hpp"

namespace redysim {
namespace {

using test::solver;

constexpr SolverMethod exponential = SolverMethod::exponential;

long double phi_of(int k, long double z) {
  if (std::fabs(z) < 1) {
    long double sum = 0, term = 1;
    for (int j = 1; j <= k; ++j) term /= j;
    for (int j = 1; j < 40; ++j, term *= z / (k + j - 1)) sum += term;
    return sum;
  }
  long double value = std::exp(z), factorial = 1;
  for (int j = 0; j < k; factorial *= ++j) value = (value - 1 / factorial) / z;
  return value;
}

TEST(PhiFunctions, of_a_number_have_their_closed_form) {
  for (const double z : {-1e6, -300.0, -3.0, -0.4, -1e-9, 0.0, 1e-3, 0.7, 4.0, 20.0}) {
    PhiFunctions phi(1, 0);
    phi.set_matrix(&z);
    ASSERT_TRUE(phi.evaluate(1));
    const double one = 1;
    const auto is_near = [](double value, long double exact) {
      EXPECT_NEAR(value, static_cast<double>(exact), 1e-13 * std::fabs(static_cast<double>(exact)));
    };
    for (int k = 1; k <= 4; ++k) {
      double value = 0, at_half = 0;
      phi.add(k, 1, &one, &value, 1, &at_half);
      is_near(value, phi_of(k, z));
      is_near(at_half, phi_of(k, 0.5L * z));
    }
  }
}

TEST(PhiFunctions, of_a_vibration_turn_its_phase) {
  const double w = 1e6, h = 0.1;
  const double by_columns[] = {0, -w * w, 1, 0};
  PhiFunctions phi(2, 0);
  phi.set_matrix(by_columns);
  ASSERT_TRUE(phi.evaluate(h));
  const double velocity[] = {0, 1};
  double integral[] = {0, 0};  // of position and velocity
  phi.add(1, h, velocity, integral);
  EXPECT_NEAR(integral[0], (1 - std::cos(w * h)) / (w * w), 1e-10 / (w * w));
  EXPECT_NEAR(integral[1], std::sin(w * h) / w, 1e-10 / w);
}

// Against the series in long doubles, whose terms do not cancel much for matrices of this size.
void agree_with_their_series(int size) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> a(size * size), x(size);
  for (double& entry : a) entry = uniform(random);
  for (double& entry : x) entry = uniform(random);
  PhiFunctions phi(size, 0);
  phi.set_matrix(a.data());
  ASSERT_TRUE(phi.evaluate(1.5));
  const auto check = [&](int k, long double h, const std::vector<double>& value) {
    std::vector<long double> term(x.begin(), x.end()), sum(size);
    for (int j = 1; j <= k; ++j)
      for (auto& entry : term) entry /= j;
    for (int j = 1; j < 80; ++j) {
      std::vector<long double> next(size);
      for (int row = 0; row < size; ++row) {
        sum[row] += term[row];
        for (int column = 0; column < size; ++column)
          next[row] += h / (k + j) * a[row + column * size] * term[column];
      }
      term = next;
    }
    for (int row = 0; row < size; ++row)
      EXPECT_NEAR(value[row], 2 * static_cast<double>(sum[row]), 1e-13) << k;
  };
  for (int k = 1; k <= 4; ++k) {
    std::vector<double> whole(size), half(size);
    phi.add(k, 2, x.data(), whole.data(), 2, half.data());
    check(k, 1.5L, whole);
    check(k, 0.75L, half);
  }
}

TEST(PhiFunctions, of_a_matrix_agree_with_their_series) {
  for (const int size : {2, 5, 7, 13}) agree_with_their_series(size);
}

// With seven leaders, products of four columns at a time would group the follower with three of them.
TEST(PhiFunctions, of_the_leaders_are_the_same_bits_with_followers) {
  for (const int leaders : {2, 3, 7}) {
    const int size = leaders + 1;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-3, 3);
    std::vector<double> without(leaders * leaders), with(size * size), x(size);
    for (int column = 0; column < leaders; ++column) {
      for (int row = 0; row < leaders; ++row)
        with[row + column * size] = without[row + column * leaders] = uniform(random);
      with[leaders + column * size] = 1e9 * uniform(random);
    }
    for (double& entry : x) entry = uniform(random);
    with[1] = without[1] = -4e8;  // requires balancing
    PhiFunctions alone(leaders, 0), followed(size, 1);
    alone.set_matrix(without.data());
    followed.set_matrix(with.data());
    ASSERT_TRUE(alone.evaluate(0.01) && followed.evaluate(0.01));
    for (int k = 1; k <= 4; ++k) {
      std::vector<double> expected(leaders), found(size);
      alone.add(k, 1, x.data(), expected.data());
      followed.add(k, 1, x.data(), found.data());
      found.pop_back();
      EXPECT_EQ(found, expected) << leaders;
    }
  }
}

TEST(PhiFunctions, refuse_what_overflows) {
  for (const double z : {1e5, 1e300, std::numeric_limits<double>::infinity(), std::nan("")}) {
    PhiFunctions phi(1, 0);
    phi.set_matrix(&z);
    EXPECT_FALSE(phi.evaluate(1)) << z;
  }
}

TEST(Exponential, order_is_four) { EXPECT_GT(test::observed_order(exponential, 1e-5, 1e-9), 3.8); }

// x'' = w^2 (1 - x) + force
struct Oscillator {
  Model model;
  Plan<double> plan;
  System system;
  std::unique_ptr<Integrator> integrator;

  Oscillator(double w, double damping, bool with_work)
      : model(read_model_text("name = 'oscillator'\ngravity = [0, 0, 0]\n[[link]]\nname = 'mass'\n"
                              "joint = 'prismatic'\nmass = 1\nrest = 1\nstiffness = " +
                                  std::to_string(w * w) + "\ndamping = " + std::to_string(damping),
                              "oscillator.toml")
                  .model),
        plan(model),
        system(plan, with_work),
        integrator(make_integrator(system, solver(exponential, 1e-6))) {
    const double y[] = {0, 0, 0};
    integrator->start(0, y);
  }
};

TEST(Exponential, steps_over_any_number_of_periods) {
  for (const double w : {1e2, 1e5, 1e7}) {
    Oscillator oscillator(w, 0, false);
    ASSERT_TRUE(oscillator.integrator->advance(1, true).ok);
    EXPECT_LT(oscillator.integrator->statistics().steps, 15) << w;  // the first ones grow
    EXPECT_NEAR(oscillator.integrator->state()[0], 1 - std::cos(w), 1e-15 * w + 1e-9) << w;
  }
}

TEST(Exponential, follows_an_input_that_grows_within_a_step) {
  const double w = 1e5, rate = 1e9;
  Oscillator oscillator(w, 0, false);
  oscillator.system.set_input_slope(0, oscillator.system.input_layout().tau[0], 1, rate);
  ASSERT_TRUE(oscillator.integrator->advance(1, true).ok);
  EXPECT_LT(oscillator.integrator->statistics().steps, 15);
  const double forced = rate / (w * w) * (1 - std::sin(w) / w);
  EXPECT_NEAR(oscillator.integrator->state()[0], 1 - std::cos(w) + forced, 1e-9);
}

// The spring's energy w^2 / 2 goes into the damper. Work that is not an output does not shorten steps.
TEST(Exponential, resolves_the_work_of_a_damped_vibration) {
  const double w = 1e4, damping = 10;
  Oscillator with_work(w, damping, true), without(w, damping, false);
  ASSERT_TRUE(with_work.integrator->advance(4, true).ok && without.integrator->advance(4, true).ok);
  EXPECT_NEAR(with_work.integrator->state()[2], -0.5 * w * w, 1e-4 * w * w);
  EXPECT_LT(without.integrator->statistics().steps, 15);
  EXPECT_NEAR(without.integrator->state()[0], 1, 1e-7);
}

}  // namespace
}  // namespace redysim
