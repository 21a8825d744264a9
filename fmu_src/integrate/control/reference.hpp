#pragma once

#include "model/trajectory.hpp"

namespace redysim {

struct JointMotion {
  double q = 0, qd = 0, qdd = 0;
};

// Where in a trajectory the time is. It is entered at the start of a step and kept until the step ends, so
// that a method sees smooth functions only, those of one phase gone on with.
enum class Phase { before = 0, inside = 1, after = 2 };

Phase phase_at(const Trajectory& trajectory, double time);

// When the phase ends, s; infinity: never.
double end_of(const Trajectory& trajectory, Phase phase);

// The first point of a table after a time, s; infinity: none.
double next_knot(const Trajectory& trajectory, double time);

JointMotion motion_at(const Trajectory& trajectory, Phase phase, double time);
double jerk_at(const Trajectory& trajectory, Phase phase, double time);  // the third derivative

}  // namespace redysim
