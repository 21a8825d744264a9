#include "integrate/control/sampler.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace redysim {
namespace {

constexpr double period = 0.01;

Controller sampled(double delay) {
  Controller controller;
  controller.law = Law::pd;
  controller.sample_time = period;
  controller.delay = delay;
  controller.joints.resize(2);
  return controller;
}

// Visits every instant from `start` on; the torques sampled at t are (t, -t). Returns what is held behind
// each of `count` instants of samples.
std::vector<double> held(const Sampler& sampler, double start, int count) {
  std::vector<double> memory(sampler.memory_size(), 0.0), seen;
  double time = start;
  while (static_cast<int>(seen.size()) < count) {
    const bool due = sampler.is_due(time, memory.data());
    if (due) {
      const double torques[] = {time, -time};
      sampler.sample(time, torques, memory.data());
    }
    sampler.arrive(time, memory.data());
    EXPECT_FALSE(sampler.is_due(time, memory.data()));
    EXPECT_EQ(sampler.held(memory.data())[1], -sampler.held(memory.data())[0]);
    if (due) seen.push_back(sampler.held(memory.data())[0]);
    const double next = sampler.next_instant(time, memory.data());
    EXPECT_GT(next, time);
    time = next;
  }
  return seen;
}

TEST(Sampler, holds_each_sample_for_a_period) {
  const Sampler sampler(sampled(0), false);
  for (const double start : {0.0, 1234.5}) {
    const std::vector<double> seen = held(sampler, start, 1000);
    for (std::size_t k = 0; k < seen.size(); ++k)
      EXPECT_NEAR(seen[k], start + static_cast<double>(k) * period, 1e-12 + 4e-16 * start);
  }
}

TEST(Sampler, lets_torques_act_after_the_delay) {
  for (const double delays : {0.4, 1.0, 2.5, 7.0}) {
    const Sampler sampler(sampled(delays * period), false);
    const std::vector<double> seen = held(sampler, 3, 100);
    const int late =
        static_cast<int>(std::ceil(delays));  // whole periods until a sample is held at an instant
    for (int k = 0; k < 100; ++k)
      EXPECT_NEAR(seen[static_cast<std::size_t>(k)], k < late ? 0 : 3 + (k - late) * period, 1e-12);
  }
}

// The arrivals k * 0.01 + 0.02 are rounded differently.
TEST(Sampler, announces_the_same_samples_with_and_without_delay) {
  const Sampler prompt(sampled(0), false), late(sampled(2 * period), false);
  std::vector<double> memory(prompt.memory_size(), 0.0), late_memory(late.memory_size(), 0.0);
  const double torques[] = {0, 0};
  for (double time = 0; time < 10; time = prompt.next_instant(time, memory.data())) {
    prompt.sample(time, torques, memory.data());
    late.sample(time, torques, late_memory.data());
    late.arrive(time, late_memory.data());
    EXPECT_EQ(late.next_instant(time, late_memory.data()), prompt.next_instant(time, memory.data()));
  }
}

TEST(Sampler, the_law_acts_until_the_first_torques_arrive_if_asked) {
  const Sampler at_rest(sampled(0.02), true), zero(sampled(0.02), false);
  const std::vector<double> memory(at_rest.memory_size(), 0.0);
  EXPECT_FALSE(at_rest.holds(memory.data()));
  EXPECT_TRUE(zero.holds(memory.data()));
}

TEST(Sampler, needs_no_memory_without_a_sample_time) {
  Controller controller = sampled(0);
  controller.sample_time = 0;
  const Sampler sampler(controller, false);
  EXPECT_FALSE(sampler.is_active());
  EXPECT_EQ(sampler.memory_size(), 0u);
}

}  // namespace
}  // namespace redysim
