#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/trajectory.hpp"

namespace redysim {

struct JointMotion {
  double q = 0, qd = 0, qdd = 0;
};

// Maximum difference, s, of two times that are equal but for rounding, also if a master adds up its steps;
// small compared with a sample period at late times as well (seconds since 1970).
double time_rounding(double time);

// Upper bound of the times that count as passed: some instants are later by rounding only.
inline double passed(double time) { return time + time_rounding(time); }

// Phase of a trajectory: the number of passed times at which its acceleration may jump (start, jumps, end).
// It is set at the start of a step and kept until its end, so that a method evaluates only the smooth
// continuation of one phase.
int phase_at(const Trajectory& trajectory, double time);

// Time at which the phase ends, s; infinity: never.
double end_of(const Trajectory& trajectory, int phase);

// Limits of a step: the next end of a phase or knot of a table, s, and the maximum step size, s, that cannot
// miss the motion until there. At the ends and in the middle of a motion from rest to rest the accelerations
// are zero.
struct StepLimits {
  double knot = std::numeric_limits<double>::infinity(), longest = knot;
};

// Reduces `limits` to those of a trajectory at `time`, which lies in the phase.
void limit_step(const Trajectory& trajectory, int phase, double time, StepLimits& limits);

JointMotion motion_at(const Trajectory& trajectory, int phase, double time);
double jerk_at(const Trajectory& trajectory, int phase, double time);  // the third derivative

}  // namespace redysim
