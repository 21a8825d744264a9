#pragma once

#include <string>
#include <vector>

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"

namespace redysim {

// What it took to close the loops of a start pose.
struct Assembly {
  bool closed = true;       // all positions; if not, q and qd are as given
  bool consistent = true;   // all velocities
  int loop = -1;            // the loop with the largest residual, index into Model::loops
  struct Residual {         // of the worst loop
    double size = 0;        // norm over its rows, m or rad (velocities: per s)
    bool in_angle = false;  // mainly an angle
  };
  Residual gap_before, gap;    // of positions: at the start values; afterwards, of `loop` if not closed
  Residual rate_before, rate;  // of velocities: at the assembled pose; afterwards
  std::vector<double> moved;   // change of q per joint of the plan; empty: none
  std::vector<double> sped;    // change of qd per joint
  std::vector<double> unit;    // per joint: what its displacement was counted in, m or rad
  std::vector<double> ball_moved,
      ball_sped;  // per spherical joint: angle of its turn; change of its angular velocity
};

// Moves q to the nearest configuration that satisfies the loops (least squares over the joints, the
// displacement of a prismatic joint in sizes of its mechanism) and qd to the nearest velocities that satisfy
// their derivative. Joints marked `hold` and prescribed ones stay. Redundant loops and singular poses are
// normal. For the start: allocates. q and qd: per joint of the plan. Overwrites positions and ground poses of
// the workspace.
Assembly assemble(const Model& model, const Plan<double>& plan, Workspace<double>& ws, double* q, double* qd);

// Why an assembly failed: "loop 'x': no configuration satisfies the loop constraints; smallest residual
// 0.17 m". Empty when it did not.
std::string failure(const Model& model, const Assembly& assembly);

// What an assembly changed by more than 1e-9 rad or m (per s), one sentence each for positions and
// velocities: "initial configuration violates the loop constraints by 26.1 mm; corrected: joint2 by -0.262
// rad".
std::vector<std::string> corrections(const Model& model, const Plan<double>& plan, const Assembly& assembly);

// "loop 'x': prescribed accelerations violate its constraints by 0.05 m/s^2".
std::string misfit(const Model& model, int loop, const Assembly::Residual& acceleration);

}  // namespace redysim
