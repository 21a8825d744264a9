#pragma once

#include "model/trajectory.hpp"

namespace redysim {

struct JointMotion {
  double q = 0, qd = 0, qdd = 0;
};

// Where in a trajectory the time is: the number of times passed at which its acceleration may jump, that is
// its start, its jumps and its end. It is entered at the start of a step and kept until the step ends, so
// that a method sees smooth functions only: those of one phase, continued.
int phase_at(const Trajectory& trajectory, double time);

// When the phase ends, s; infinity: never.
double end_of(const Trajectory& trajectory, int phase);

// The first point of a table after a time in the phase, s; infinity: none.
double next_knot(const Trajectory& trajectory, int phase, double time);

JointMotion motion_at(const Trajectory& trajectory, int phase, double time);
double jerk_at(const Trajectory& trajectory, int phase, double time);  // the third derivative

}  // namespace redysim
