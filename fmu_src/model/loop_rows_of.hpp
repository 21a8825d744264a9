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
  std::vector<LoopRow> left_out;  // a planar scene keeps these in all its poses, or breaks them in all
  // Rows in ground directions that turn with no body: the equations then concern all joints down to
  // the ground, not only those between the two links.
  bool tied_to_ground = false;
};

// How many multipliers a cut joint has, whether or not the scene makes some of them redundant.
int multiplier_count(const Loop& loop);

// The equations of each loop. In a planar scene a revolute cut keeps its two in-plane rows; no motion changes
// the others.
std::vector<LoopRows> loop_rows_of(const Model& model);

}  // namespace redysim
