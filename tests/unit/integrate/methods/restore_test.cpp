#include <gtest/gtest.h>

#include <cstring>

#include "unit/integrate/rig.hpp"

// Saved and restored integrators go on bit for bit.

namespace redysim {
namespace {

using test::Rig;
using test::solver;

class Restored : public testing::TestWithParam<SolverMethod> {};

INSTANTIATE_TEST_SUITE_P(Methods, Restored, test::every_method(), test::method_name);

// Torques that hold still for ten steps, then change: in the middle of smooth runs and at their ends.
bool drive(Rig& rig, int k, double step = 0.005) {
  const bool changed = k % 10 == 1;
  for (int i = 0; i < rig.plan.nv; ++i) rig.system.tau(i) = 0.01 * ((k - 1) / 10 % 3) - 0.004 * i;
  return rig.integrator->advance(k * step, changed).ok;
}

struct Recorded {
  std::vector<double> state;
  Statistics statistics;
};

Recorded record(const Rig& rig) { return {rig.state(), rig.integrator->statistics()}; }

void expect_equal(const Recorded& a, const Recorded& b, int k) {
  EXPECT_EQ(std::memcmp(a.state.data(), b.state.data(), a.state.size() * sizeof(double)), 0) << "step " << k;
  EXPECT_EQ(a.statistics.steps, b.statistics.steps);
  EXPECT_EQ(a.statistics.rejected, b.statistics.rejected);
  EXPECT_EQ(a.statistics.evaluations, b.statistics.evaluations);
  EXPECT_EQ(a.statistics.step_size, b.statistics.step_size);
  EXPECT_EQ(a.statistics.error_estimate, b.statistics.error_estimate);
}

TEST_P(Restored, goes_on_in_a_fresh_integrator_as_if_never_interrupted) {
  constexpr int steps = 60;
  Rig whole("kuka_kr5", solver(GetParam(), 1e-7), true);
  std::vector<std::vector<unsigned char>> saved(steps + 1);
  std::vector<Recorded> recorded(steps + 1);
  for (int k = 0; k <= steps; ++k) {
    if (k > 0) {
      ASSERT_TRUE(drive(whole, k));
    }
    whole.integrator->save(saved[k]);
    recorded[k] = record(whole);
  }
  for (int from = 0; from <= steps; from += 3) {
    Rig other("kuka_kr5", solver(GetParam(), 1e-7), true);
    other.system.inputs().assign(6, 99.0);  // the inputs are the caller's: they stay as they are
    ASSERT_TRUE(other.integrator->restore(saved[from].data(), saved[from].size()));
    EXPECT_EQ(other.system.inputs(), std::vector<double>(6, 99.0));
    expect_equal(record(other), recorded[from], from);
    for (int k = from + 1; k <= std::min(from + 15, steps); ++k) {
      ASSERT_TRUE(drive(other, k));
      expect_equal(record(other), recorded[k], k);
    }
  }
}

TEST_P(Restored, goes_on_with_loops_friction_stops_and_contacts) {
  constexpr double step = 0.02;
  for (const char* model : {"four_bar", "stick_slip", "pendulum_stops", "bouncing_ball"}) {
    SCOPED_TRACE(model);
    Rig whole(model, solver(GetParam()));
    std::vector<std::vector<unsigned char>> saved(41);
    for (int k = 1; k <= 40; ++k) {
      ASSERT_TRUE(drive(whole, k, step));
      whole.integrator->save(saved[k]);
    }
    for (int from = 1; from < 40; from += 2) {
      Rig other(model, solver(GetParam()));
      ASSERT_TRUE(other.integrator->restore(saved[from].data(), saved[from].size()));
      for (int k = from + 1; k <= 40; ++k) ASSERT_TRUE(drive(other, k, step));
      expect_equal(record(other), record(whole), from);
    }
  }
}

TEST_P(Restored, goes_back_in_the_same_integrator) {
  Rig rig("double_pendulum", solver(GetParam()));
  for (int k = 1; k <= 25; ++k) ASSERT_TRUE(drive(rig, k));
  std::vector<unsigned char> saved, again;
  rig.integrator->save(saved);
  for (int k = 26; k <= 43; ++k) ASSERT_TRUE(drive(rig, k));
  const Recorded first = record(rig);
  ASSERT_TRUE(rig.integrator->restore(saved.data(), saved.size()));
  rig.integrator->save(again);
  EXPECT_EQ(again, saved);
  for (int k = 26; k <= 43; ++k) ASSERT_TRUE(drive(rig, k));
  expect_equal(record(rig), first, 43);
}

// Long enough for a multistep method to be restarted by itself.
TEST_P(Restored, goes_on_after_thousands_of_steps) {
  SolverSettings settings = solver(GetParam(), 1e-4);
  settings.max_step = 1e-3;
  Rig whole("pendulum", settings), other("pendulum", settings);
  ASSERT_TRUE(whole.integrator->advance(4.5, true).ok);
  std::vector<unsigned char> saved;
  whole.integrator->save(saved);
  ASSERT_TRUE(other.integrator->restore(saved.data(), saved.size()));
  for (Rig* rig : {&whole, &other}) {
    ASSERT_TRUE(rig->integrator->advance(9, false).ok);
  }
  expect_equal(record(other), record(whole), 9);
}

TEST_P(Restored, refuses_what_is_not_its_own_and_stays_unchanged) {
  Rig rig("double_pendulum", solver(GetParam()));
  for (int k = 1; k <= 15; ++k) ASSERT_TRUE(drive(rig, k));
  std::vector<unsigned char> saved;
  rig.integrator->save(saved);
  for (int k = 16; k <= 20; ++k) ASSERT_TRUE(drive(rig, k));
  const Recorded before = record(rig);

  for (std::size_t size = 0; size < saved.size(); ++size)
    EXPECT_FALSE(rig.integrator->restore(saved.data(), size)) << size;
  std::vector<unsigned char> longer = saved;
  longer.push_back(0);
  EXPECT_FALSE(rig.integrator->restore(longer.data(), longer.size()));
  EXPECT_FALSE(rig.integrator->restore(nullptr, 0));

  std::vector<unsigned char> foreign;
  Rig("pendulum", solver(GetParam())).integrator->save(foreign);
  EXPECT_FALSE(rig.integrator->restore(foreign.data(), foreign.size()));
  foreign.clear();
  Rig("double_pendulum", solver(GetParam(), 1e-5)).integrator->save(foreign);
  EXPECT_FALSE(rig.integrator->restore(foreign.data(), foreign.size()));
  const SolverMethod another = GetParam() == SolverMethod::erk ? SolverMethod::bdf : SolverMethod::erk;
  foreign.clear();
  Rig("double_pendulum", solver(another)).integrator->save(foreign);
  EXPECT_FALSE(rig.integrator->restore(foreign.data(), foreign.size()));

  expect_equal(record(rig), before, 20);
}

// Damaged bytes are refused or give a state, but neither crash nor hang.
TEST_P(Restored, survives_damaged_bytes) {
  Rig rig("double_pendulum", solver(GetParam()));
  for (int k = 1; k <= 15; ++k) ASSERT_TRUE(drive(rig, k));
  std::vector<unsigned char> saved;
  rig.integrator->save(saved);
  for (std::size_t i = 0; i < saved.size(); ++i) {
    for (int mask : {0x80, 0xff, 0x7f}) {
      std::vector<unsigned char> damaged = saved;
      damaged[i] = static_cast<unsigned char>(damaged[i] ^ mask);
      rig.integrator->restore(damaged.data(), damaged.size());
    }
  }
  ASSERT_TRUE(rig.integrator->restore(saved.data(), saved.size()));
  EXPECT_TRUE(drive(rig, 16));
}

}  // namespace
}  // namespace redysim
