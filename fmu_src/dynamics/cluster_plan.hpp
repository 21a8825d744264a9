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
  int root = ground;              // of its cluster
  Vec3<Scalar> point_a, point_b;  // body frames
  int first_row = 0;              // in the row numbering of the whole plan
  std::vector<ConstraintRow<Scalar>> rows;
};

// One row's wrench on one side of its loop, passing one joint on the way to the cluster's root.
struct RowPassage {
  int row = 0;         // global row
  int side = 0;        // 0: a, 1: b
  bool merge = false;  // both sides meet at this joint's body and go on as side 0
};

// Loops and rows of a cluster are consecutive in the plan's numbering.
struct ClusterPlan {
  int root = ground;  // the body all paths of the cluster meet at
  int first_loop = 0, loop_count = 0;
  int first_row = 0, row_count = 0;
  int first_passage = 0;           // in the numbering of all clusters' passages
  std::vector<int> joints;         // of the cluster, descending
  std::vector<int> first_coupled;  // envelope of S: per local row the first local row it couples to
  std::vector<int> row_group;      // per local row: rows of one loop and one kind share a group
  std::vector<char> row_turns;     // per local row: whether it closes an angle, not a distance
  std::vector<int> passage_begin;  // per cluster joint (+1): its passages
  std::vector<RowPassage> passages;
};

// One step of the leaves-to-root pass: a joint outside all loops, or a whole cluster.
struct EliminationStep {
  bool is_cluster = false;
  int index = 0;
};

}  // namespace redysim
