#pragma once

#include <vector>

#include "model/model.hpp"

namespace redysim {

// One scalar equation of a cut joint. u and v are directions in the frames of link a and link b.
struct LoopRow {
  int index = 0;           // index among the multipliers of this loop
  bool rotation = false;   // u (link a) . v (link b) = 0; otherwise u . (x_b - x_a) = 0
  bool on_ground = false;  // position equation with u in ground axes instead of link a's
  Vec3<double> u = Vec3<double>::Zero(), v = Vec3<double>::Zero();
};

struct LoopRows {
  std::vector<LoopRow> rows;
  std::vector<LoopRow> left_out;  // redundant because the mechanism is planar
  // True if the equations contain directions that are fixed to the ground and therefore depend on all joints
  // down to the ground, not only on those between the two links.
  bool tied_to_ground = false;
};

// Number of multipliers of a cut joint, including redundant ones.
int multiplier_count(const Loop& loop);

// The equations of each loop. In a planar mechanism a revolute cut joint keeps its two in-plane equations;
// the other three do not depend on the configuration and are left out.
std::vector<LoopRows> loop_rows_of(const Model& model);

}  // namespace redysim
