#pragma once

#include <array>

#include "dynamics/assembly/assembly.hpp"
#include "integrate/system/system.hpp"
#include "integrate/system/tangent.hpp"

// Where a simulation starts. The FMU begins here, and `describe` checks and draws the same.

namespace redysim {

// q, qd and qdd of a prescribed joint before a master sets them.
std::array<double, 3> start_motion(const Joint& joint);

// Prescribed joints move by start_motion(...) from `time` on, trajectories from their own start.
void begin_motions(const Model& model, System& system, double time);

// Fills y (system.size()) with the start values of `model` as they are given.
void take_start_values(const Model& model, const System& system, double* y);

// The same, with loops closed (dynamics/assembly/assembly.hpp); where that fails, y is as given. Allocates.
Assembly take_start(const Model& model, System& system, double time, double* y);

// The loop that the prescribed accelerations violate at (time, y), if any. Allocates.
Tangent::Misfit misfit_of_accelerations(const Model& model, System& system, double time, const double* y);

// `model` with the start values of that y.
Model at_start(const Model& model, System& system, double time, const double* y);

}  // namespace redysim
