#pragma once

#include <vector>

#include "math/vec3.hpp"
#include "model/model.hpp"

// Closed loops prepared for the recursion. Loops that share a joint form a cluster; each cluster is
// eliminated as soon as the recursion reaches its root body, so independent loops along a tree stay
// independent, and inside a cluster two rows couple only where their paths share a joint.

namespace redysim {

// One scalar constraint. A position row closes direction . (x_b - x_a), a rotation row u_a . v_b.
template <class Scalar>
struct ConstraintRow {
  enum class Kind { position_on_a, position_on_root, rotation };
  Kind kind = Kind::position_on_a;
  int index = 0;   // among the multipliers of its loop
  Vec3<Scalar> u;  // position: direction, in body a's frame or (on_root) in ground axes; rotation: in a
  Vec3<Scalar> v;  // rotation: direction in body b's frame
};

template <class Scalar>
struct LoopPlan {
  int loop = 0;  // index into Model::loops
  int body_a = ground, body_b = ground;
  int root = ground;              // where its paths meet; the ground for rows tied to ground directions
  Vec3<Scalar> point_a, point_b;  // body frames
  int first_row = 0;              // in the row numbering of the whole plan
  std::vector<ConstraintRow<Scalar>> rows;
};

// One row's wrench on one side of its loop, passing one joint on the way to the cluster's root.
struct RowPassage {
  int row = 0;         // global row
  int side = 0;        // 0: a, 1: b
  bool merge = false;  // both sides meet at this joint's body, or have met, and go on as side 0
  bool root = false;   // this joint's body is the root of the loop
};

// Loops and rows of a cluster are consecutive in the plan's numbering.
struct ClusterPlan {
  int root = ground;  // the body all paths of the cluster meet at
  int first_loop = 0, loop_count = 0;
  int first_row = 0, row_count = 0;
  bool split = false;              // into fronts, which serve while no row depends on others
  int first_passage = 0;           // in the numbering of all clusters' passages
  std::vector<int> joints;         // of the cluster, descending
  std::vector<int> first_coupled;  // envelope of S: per local row the first local row it couples to
  std::vector<int> passage_begin;  // per cluster joint (+1): its passages
  std::vector<RowPassage> passages;
};

// The loops of a cluster that meet at one body, eliminated there though loops that meet further up cross
// their joints: those rows are still open and take part in the elimination as right-hand sides. The matrix
// has one row for each eliminated and then each open row, one column for each eliminated one.
struct FrontPlan {
  int root = ground;
  std::vector<int> rows;          // eliminated here, in the numbering of the whole plan
  std::vector<int> open;          // rows still open that couple to them
  std::vector<int> open_side;     // of each: the side of its loop that stands on the root
  std::vector<int> open_entries;  // of each pair of them, the later with all up to itself: its matrix entry
  std::vector<int> joints;  // of the cluster below the root, as far as not eliminated before; descending
  std::vector<int> passage_begin;  // per joint (+1): its passages, of any loop of the cluster
  std::vector<RowPassage> passages;
  std::vector<int> entries;  // of each pair of passages of one joint, likewise
  int first_passage = 0;     // in the numbering of all fronts' passages
  int first_entry = 0;       // of the matrix, among the entries of all fronts
};

// One step of the leaves-to-root pass: a joint outside all loops, a whole cluster, or a front of one.
struct EliminationStep {
  enum class Kind { joint, cluster, front };
  Kind kind = Kind::joint;
  int index = 0;
};

}  // namespace redysim
