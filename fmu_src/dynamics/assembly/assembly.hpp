#pragma once

#include <vector>

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"

namespace redysim {

// Result of an assembly: how the start values were corrected to satisfy the loop constraints.
struct Assembly {
  bool closed = true;          // positions satisfy all loops; otherwise q and qd are not changed
  bool consistent = true;      // velocities satisfy all loops
  bool nearly_closed = false;  // not closed, but rounded angles and lengths may leave such a residual
  int constraint = -1;         // with the maximum residual: index into Model::loops, or coupling_constraint
  struct Residual {
    double size = 0;        // norm over the rows, m or rad (velocities: per s)
    bool in_angle = false;  // mainly rotational
  };
  Residual gap_before, gap;    // maximum position residual: at the start values; after assembly
  Residual rate_before, rate;  // maximum velocity residual, assembled configuration: before; after
  std::vector<double> moved;   // change of q per joint of the plan; empty: none
  std::vector<double> sped;    // change of qd per joint
  std::vector<double> unit;    // unit of the displacement per joint, m or rad
  // per spherical joint: rotation angle, rad; change of the angular velocity, rad/s
  std::vector<double> ball_moved, ball_sped;
};

// Assembly::constraint of a coupling; couplings are numbered after all loops.
inline int coupling_constraint(const Model& model, int coupling) {
  return static_cast<int>(model.loops.size()) + coupling;
}

// Moves q to the nearest configuration that satisfies the loops (least squares over the joints; displacements
// of prismatic joints relative to the size of the mechanism), and qd to the nearest velocities that satisfy
// the derivative of the constraints. Joints marked `hold` and prescribed joints do not change. Redundant
// constraints and singular configurations are permitted. Allocates: for the start only. q and qd: per joint
// of the plan. Overwrites positions and ground poses of the workspace.
Assembly assemble(const Model& model, const Plan<double>& plan, Workspace<double>& ws, double* q, double* qd);

}  // namespace redysim
