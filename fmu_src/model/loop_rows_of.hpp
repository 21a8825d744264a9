#pragma once

#include <vector>

#include "model/model.hpp"

namespace redysim {

// One scalar equation of a cut joint, directions in the frames of the loop's links.
struct LoopRow {
  int index = 0;           // its place among the multipliers of its type
  bool rotation = false;   // u (link a) . v (link b) = 0; otherwise u . (x_b - x_a) = 0
  bool on_ground = false;  // position rows: u in ground axes instead of link a's
  Vec3<double> u = Vec3<double>::Zero(), v = Vec3<double>::Zero();
};

struct LoopRows {
  std::vector<LoopRow> rows;
  std::vector<LoopRow> left_out;  // redundant in a planar mechanism
  // Rows in directions fixed to the ground: the equations then depend on all joints down to the ground, not
  // only on those between the two links.
  bool tied_to_ground = false;
};

// Number of multipliers of a cut joint, redundant ones included.
int multiplier_count(const Loop& loop);

// The equations of each loop. In a planar mechanism a revolute cut keeps its two in-plane rows; the others do
// not depend on the configuration.
std::vector<LoopRows> loop_rows_of(const Model& model);

}  // namespace redysim
