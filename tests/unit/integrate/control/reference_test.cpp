#include "integrate/control/reference.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "unit/model/read.hpp"

// Trajectories against closed forms and their own differences.

namespace redysim {
namespace {

StepLimits limits_at(const Trajectory& trajectory, int phase, double time) {
  StepLimits limits;
  limit_step(trajectory, phase, time, limits);
  return limits;
}

double longest_step(const Trajectory& trajectory, int phase, double time) {
  return limits_at(trajectory, phase, time).longest;
}

JointMotion at(const Trajectory& trajectory, double time) {
  return motion_at(trajectory, phase_at(trajectory, time), time);
}

Trajectory trajectory(const std::string& fields) {
  return test::read(test::arm + "drive = 'motion'\n[[trajectory]]\njoint = 'a'\n" + fields)
      .trajectories.at(0);
}

const char* const all[] = {
    "type = 'cycloid'\nfrom = 0.2\nto = -1.5\nstart = 0.3\nduration = 1.1\n",
    "type = 'quintic'\nfrom = 0.2\nto = -1.5\nstart = 0.3\nduration = 1.1\nspeed_from = 1\nspeed_to = -2\n",
    "type = 'cubic'\nfrom = 0.2\nto = -1.5\nstart = 0.3\nduration = 1.1\nspeed_from = 1\nspeed_to = -2\n",
    "type = 'speed'\nfrom = 0.2\nspeed = -3\nstart = 0.3\n",
    "type = 'polynomial'\ncoefficients = [1, -2, 3, -4]\nstart = 0.3\n",
    "type = 'polynomial'\ncoefficients = [1, -2, 3, -4]\nstart = 0.3\nduration = 1\n",
    "type = 'table'\ntime = [0.3, 0.5, 1, 1.4]\nq = [0, 1, -1, 2]\n",
    "type = 'table'\ntime = [0.3, 0.5, 1, 1.4]\nq = [0, 1, -1, 2]\nqd = [1, 2, 3, 4]\n",
    "type = 'table'\ntime = [0.3, 0.5, 0.5, 1, 1, 1.4]\nq = [0, 1, 1, -1, -1, 2]\nqd = [1, 2, 2, 3, 3, 4]\n"};

TEST(reference, velocity_and_acceleration_are_the_derivatives) {
  for (const char* fields : all) {
    const Trajectory tested = trajectory(fields);
    for (double t : {-0.4, 0.1, 0.35, 0.6, 0.95, 1.2, 1.39, 1.7, 2.5}) {
      const double h = 1e-4;
      const JointMotion before = at(tested, t - h), now = at(tested, t), after = at(tested, t + h);
      EXPECT_NEAR(now.qd, (after.q - before.q) / (2 * h), 3e-5) << fields << t;
      EXPECT_NEAR(now.qdd, (after.qd - before.qd) / (2 * h), 3e-5) << fields << t;
    }
  }
}

TEST(reference, position_and_velocity_do_not_jump_where_a_phase_ends) {
  for (const char* fields : all) {
    const Trajectory tested = trajectory(fields);
    for (int phase = 0; std::isfinite(end_of(tested, phase)) || phase == 0; ++phase) {
      const double border = end_of(tested, phase);
      if (std::isinf(border)) continue;
      const JointMotion one = motion_at(tested, phase, border), other = motion_at(tested, phase + 1, border);
      EXPECT_NEAR(one.q, other.q, 1e-14) << fields;
      EXPECT_NEAR(one.qd, other.qd, 1e-13) << fields;
    }
  }
}

TEST(reference, the_cycloid_is_redysims_equation_1) {
  const Trajectory tested = trajectory(all[0]);
  for (double t : {0.3, 0.5, 0.9, 1.3, 1.4}) {
    const double s = t - 0.3, T = 1.1;
    EXPECT_NEAR(at(tested, t).q, 0.2 + (-1.5 - 0.2) / T * (s - T / (2 * M_PI) * std::sin(2 * M_PI * s / T)),
                1e-15);
  }
  for (double t : {0.3, 1.4}) {
    EXPECT_NEAR(at(tested, t).qd, 0, 1e-13);
    EXPECT_NEAR(at(tested, t).qdd, 0, 1e-13);
  }
  EXPECT_EQ(at(tested, -1).q, 0.2);
  EXPECT_NEAR(at(tested, 9).q, -1.5, 1e-15);
}

TEST(reference, point_to_point_polynomials_meet_their_ends) {
  for (int k : {1, 2}) {
    const Trajectory tested = trajectory(all[k]);
    EXPECT_NEAR(at(tested, 0.3).q, 0.2, 1e-14);
    EXPECT_NEAR(at(tested, 0.3).qd, 1, 1e-14);
    EXPECT_NEAR(at(tested, 1.4).q, -1.5, 1e-14);
    EXPECT_NEAR(at(tested, 1.4).qd, -2, 1e-13);
  }
  const Trajectory quintic = trajectory(all[1]);
  EXPECT_NEAR(motion_at(quintic, 1, 0.3).qdd, 0, 1e-13);
  EXPECT_NEAR(motion_at(quintic, 1, 1.4).qdd, 0, 1e-12);
}

TEST(reference, outside_its_time_a_trajectory_keeps_the_velocity_of_its_end) {
  const Trajectory tested = trajectory(all[1]);
  EXPECT_NEAR(at(tested, 0.1).q, 0.2 - 0.2 * 1, 1e-14);
  EXPECT_NEAR(at(tested, 2.4).q, -1.5 - 2 * 1, 1e-13);
  EXPECT_EQ(at(tested, 2.4).qdd, 0);
}

// q = |t - 1|^3 + 3 |t - 1| (t - 1), and from t = 1.5 on a parabola: quintics are exact on each side of the
// jumps.
TEST(reference, two_rows_at_one_time_let_the_acceleration_jump) {
  const Trajectory tested = trajectory(
      "type = 'table'\ntime = [0, 0.6, 1, 1, 1.5, 1.5, 2]\n"
      "q = [-2, -0.416, 0, 0, 0.875, 0.875, 3.75]\nqd = [3, 1.92, 0, 0, 3.75, 3.75, 7.75]\n"
      "qdd = [0, -3.6, -6, 6, 9, 8, 8]\n");
  EXPECT_EQ(tested.jumps, (std::vector<std::size_t>{2, 3}));
  for (double t : {0.0, 0.3, 0.6, 0.8, 0.999}) {
    EXPECT_EQ(phase_at(tested, t), 1);
    EXPECT_NEAR(at(tested, t).q, std::pow(1 - t, 3) - 3 * (t - 1) * (t - 1), 1e-14) << t;
    EXPECT_NEAR(at(tested, t).qdd, 6 * (1 - t) - 6, 1e-12) << t;
  }
  for (double t : {1.0, 1.3, 1.49}) {
    EXPECT_EQ(phase_at(tested, t), 2);
    EXPECT_NEAR(at(tested, t).q, std::pow(t - 1, 3) + 3 * (t - 1) * (t - 1), 1e-14) << t;
    EXPECT_NEAR(at(tested, t).qdd, 6 * (t - 1) + 6, 1e-12) << t;
  }
  EXPECT_EQ(phase_at(tested, 1.5), 3);
  EXPECT_EQ(phase_at(tested, 2.0), 4);
  // the phase decides at its end: its last piece is continued
  EXPECT_NEAR(motion_at(tested, 1, 1).qdd, -6, 1e-12);
  EXPECT_NEAR(motion_at(tested, 2, 1.51).qdd, 6 * 0.51 + 6, 1e-12);
  EXPECT_NEAR(motion_at(tested, 2, 0.99).q, -1e-6 + 3e-4, 1e-14);
  EXPECT_NEAR(jerk_at(tested, 1, 1), -6, 1e-10);
  EXPECT_NEAR(jerk_at(tested, 2, 1), 6, 1e-10);
  // steps end at the other points of the phase
  EXPECT_EQ(limits_at(tested, 1, 0.1).knot, 0.6);
  EXPECT_EQ(limits_at(tested, 1, 0.7).knot, 1);
  EXPECT_EQ(end_of(tested, 1), 1);
  EXPECT_EQ(end_of(tested, 2), 1.5);
  EXPECT_EQ(end_of(tested, 3), 2);
}

TEST(reference, steps_are_short_where_a_trajectory_accelerates) {
  const Trajectory table = trajectory(
      "type = 'table'\ntime = [0, 1, 3, 4]\nq = [0, 2, 2, 3]\nqd = [0, 0, 0, 0]\nqdd = [0, 0, 0, 0]\n");
  EXPECT_NEAR(longest_step(table, 1, 0.5), 1.0 / 3, 1e-15);
  EXPECT_TRUE(std::isinf(longest_step(table, 1, 2)));
  EXPECT_NEAR(longest_step(table, 1, 3), 1.0 / 3, 1e-15);
  EXPECT_TRUE(std::isinf(longest_step(table, 2, 4.5)));
  for (int k : {0, 1, 2}) {
    EXPECT_TRUE(std::isinf(longest_step(trajectory(all[k]), 0, 0))) << k;
    EXPECT_NEAR(longest_step(trajectory(all[k]), 1, 0.5), 1.1 / 8, 1e-15) << k;
  }
  EXPECT_TRUE(std::isinf(longest_step(trajectory(all[3]), 1, 1)));
  EXPECT_TRUE(std::isinf(longest_step(trajectory(all[4]), 1, 1)));
}

}  // namespace
}  // namespace redysim
