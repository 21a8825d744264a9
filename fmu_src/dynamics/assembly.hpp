#pragma once

#include <string>
#include <vector>

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"

namespace redysim {

// What it took to close the loops of a start pose.
struct Assembly {
  bool closed = true;         // all positions; if not, q and qd are as given
  bool consistent = true;     // all velocities
  int loop = -1;              // the loop that stays widest open, index into Model::loops
  bool in_angle = false;      // it stays open by an angle rather than a distance
  double gap_before = 0;      // largest norm over a loop's rows, m or rad
  double gap = 0;             // the same afterwards, of `loop` if not closed
  double rate = 0;            // m/s or rad/s that held joints leave of the velocities
  std::vector<double> moved;  // change of q per joint of the plan; empty: none
  std::vector<double> sped;   // change of qd per joint
  std::vector<double> unit;   // per joint: what its displacement was counted in, m or rad
};

// Moves q to the nearest closed pose (least squares over the joints, the displacement of a prismatic joint
// counted in sizes of its mechanism) and qd to the nearest velocities that keep it closed. Joints marked
// `hold` and prescribed ones stay. Redundant loops and singular poses are normal. For the start: allocates.
// q and qd: per joint of the plan. Overwrites positions and ground poses of the workspace.
Assembly assemble(const Model& model, const Plan<double>& plan, Workspace<double>& ws, double* q, double* qd);

// Why an assembly failed: "loop 'x' cannot close: 0.0259 m remain open". Empty when it did not.
std::string failure(const Model& model, const Assembly& assembly);

// What an assembly moved, one sentence: "the start pose is open by 0.0261 m and assembles with joint2 by
// -0.262 rad, slider by 0.01 m". Empty when it moved nothing by more than 1e-9 rad or m.
std::string assembly_text(const Model& model, const Plan<double>& plan, const Assembly& assembly);

// The same for velocities: "joint2 by -1.4 rad/s".
std::string changed_velocities(const Model& model, const Plan<double>& plan, const Assembly& assembly);

}  // namespace redysim
