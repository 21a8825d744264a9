#pragma once

#include <array>

#include "dynamics/assembly/assembly.hpp"
#include "integrate/system/equilibrium.hpp"
#include "integrate/system/system.hpp"
#include "integrate/system/tangent.hpp"

// The initial state of a simulation, used by the FMU and by `describe`.

namespace redysim {

// q, qd and qdd of a prescribed joint before the master sets them.
std::array<double, 3> start_motion(const Joint& joint, const JointParameters<double>& start);

// Starts the prescribed motions at `time`: joints with a trajectory follow it, the others move by
// start_motion(...) of the model.
void begin_motions(const Model& model, System& system, double time);

// Gives the quaternions of spherical joints unit length.
void normalise_quaternions(const StateLayout& layout, double* y);

// Fills y (system.size()) with the start values as given, but for the length of quaternions.
void set_start_values(const Parameters<double>& parameters, const System& system, double* y);

struct Start {
  Assembly assembly;
  Rest rest;
};

// The same, then assembles the loops (dynamics/assembly/assembly.hpp); if assembly fails, y is as given.
// Finally moves y to equilibrium (equilibrium.hpp) if the model starts there. Allocates.
Start assemble_start(const Model& model, const Parameters<double>& parameters, System& system, double time,
                     double* y);

// The constraint that the prescribed accelerations violate at (time, y), if any. Allocates.
Tangent::Misfit misfit_of_accelerations(const Model& model, const Parameters<double>& parameters,
                                        System& system, double time, const double* y);

// A copy of `model` with the positions and velocities of `y` as start values.
Model at_start(const Model& model, System& system, double time, const double* y);

}  // namespace redysim
