#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/trajectory.hpp"

namespace redysim {

struct JointMotion {
  double q = 0, qd = 0, qdd = 0;
};

// The time up to which instants count as passed: some are ahead by rounding only.
inline double passed(double time) { return time + 1e-12 * std::max(1.0, std::abs(time)); }

// Where in a trajectory the time is: the number of times passed at which its acceleration may jump, that is
// its start, its jumps and its end. It is entered at the start of a step and kept until the step ends, so
// that a method sees smooth functions only: those of one phase, continued.
int phase_at(const Trajectory& trajectory, double time);

// When the phase ends, s; infinity: never.
double end_of(const Trajectory& trajectory, int phase);

// What limits a step: the first end of a phase or point of a table after its start, s, and the longest step
// that cannot miss the motion until there. At the ends and in the middle of a motion from rest to rest the
// accelerations are zero.
struct StepLimits {
  double knot = std::numeric_limits<double>::infinity(), longest = knot;
};

// Reduces limits to those of a trajectory from a time in the phase.
void limit_step(const Trajectory& trajectory, int phase, double time, StepLimits& limits);

JointMotion motion_at(const Trajectory& trajectory, int phase, double time);
double jerk_at(const Trajectory& trajectory, int phase, double time);  // the third derivative

}  // namespace redysim
