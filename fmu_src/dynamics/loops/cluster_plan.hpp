#pragma once

#include <vector>

#include "math/vec3.hpp"
#include "model/parameters.hpp"

// Closed loops and rigid couplings prepared for the recursion. Those that share a joint form a cluster. A
// cluster is eliminated when the recursion arrives at its root body, so clusters are independent of each
// other. Within a cluster two rows are coupled only if their paths share a joint.

namespace redysim {

// One scalar constraint phi = 0. Position row: phi = direction . (x_b - x_a); rotation row: phi = u_a . v_b.
template <class Scalar>
struct ConstraintRow {
  enum class Kind { position_on_a, position_on_root, rotation };
  Kind kind = Kind::position_on_a;
  int index = 0;   // index among the multipliers of its loop
  Vec3<Scalar> u;  // direction: position row in a's or ground axes, rotation row in a
  Vec3<Scalar> v;  // rotation row: direction in body b's frame

  template <class Other>
  ConstraintRow<Other> cast() const {
    return {static_cast<typename ConstraintRow<Other>::Kind>(kind), index, u.template cast<Other>(),
            v.template cast<Other>()};
  }
};

template <class Scalar>
struct LoopPlan {
  int loop = 0;  // index into Model::loops
  int body_a = ground, body_b = ground;
  int root = ground;  // body at which its two sides meet; the ground for rows with ground directions
  int entry_a = ground, entry_b = ground, entry_root = ground;  // indices into Workspace::ground
  Vec3<Scalar> point_a, point_b;                                // in body frames
  double summand = 0;                                           // maximum length of a term of the points, m
  int first_row = 0;                                            // global index
  std::vector<ConstraintRow<Scalar>> rows;

  template <class Other>
  LoopPlan<Other> cast() const {
    return {loop,
            body_a,
            body_b,
            root,
            entry_a,
            entry_b,
            entry_root,
            point_a.template cast<Other>(),
            point_b.template cast<Other>(),
            summand,
            first_row,
            cast_each<Other>(rows)};
  }
};

// y = sum of ratios[k] q[joints[k]] - offset.
struct CoupledJoints {
  int coupling = 0;  // index into Model::couplings
  std::vector<int> joints;
  std::vector<double> ratios;
  double offset = 0;
};

// A row y = 0 of the rigid couplings (dynamics/loops/coupling_chains.hpp).
struct CouplingPlan : CoupledJoints {
  int root = ground;  // the deepest body inboard of all its joints
  int row = 0;        // global index
};

// Contribution of a row's multiplier to the multiplier of a coupling.
struct MultiplierPart {
  int row = 0;  // global index
  double factor = 1;
};

// The transmission of one row's wrench over one joint towards the cluster's root: from one side of its loop,
// or from all coupled joints outboard. The row of a coupling starts without a wrench; on each coupled joint
// its ratio is added to the lever.
struct RowCrossing {
  int row = 0;         // global index
  int loop = 0;        // global index; -1: a coupling
  int side = 0;        // 0: a, 1: b
  bool first = false;  // first crossing of its loop at this joint; these are consecutive
  bool merge = false;  // the two sides have met at or before this joint's body; their sum is stored as side 0
  bool root = false;   // this joint's body is the root of the loop
  // for couplings:
  double ratio = 0;  // ratio of this joint
  int wrench = 0;    // wrench of the row on this joint's body: index into LoopState::coupling_wrench
  int inboard = -1;  // wrench on the parent, to which it is added: the same; -1: the root

  bool of_coupling() const { return loop < 0; }
};

// Loops, couplings and rows of a cluster have consecutive global indices.
struct ClusterPlan {
  int root = ground;        // the body at which all paths end
  int root_entry = ground;  // with loops: index into Workspace::ground of the root relative to its own origin
  int first_loop = 0, loop_count = 0;
  int first_coupling = 0, coupling_count = 0;
  int first_row = 0, row_count = 0;
  bool split = false;      // split into fronts, which are used while all rows are independent
  int first_crossing = 0;  // index among the crossings of all clusters
  int end_crossing() const { return first_crossing + static_cast<int>(crossings.size()); }
  std::vector<int> joints;          // descending
  std::vector<int> first_coupled;   // envelope of S: per local row, its first coupled local row
  std::vector<int> crossing_begin;  // per joint (+1): its first crossing
  std::vector<RowCrossing> crossings;
};

// The loops of a cluster that meet at one body, eliminated there by a dense frontal matrix (Duff and Reid
// 1983). Rows of loops that meet closer to the root are still open: they act as right-hand sides. The matrix
// has one line for each eliminated and then for each open row, and one column for each eliminated row.
struct FrontPlan {
  int root = ground;
  std::vector<int> rows;               // rows eliminated here, global indices
  std::vector<int> open;               // open rows coupled to these, global indices
  std::vector<int> open_side;          // per open row: side of its loop at the root; -1: a coupling
  std::vector<int> open_wrench;        // per open row of a coupling: its wrench on the root body
  std::vector<int> open_entries;       // matrix entry of each pair (n, m <= n) of open rows, all fronts
  std::vector<int> joints;             // joints beyond the root that no deeper front eliminates, descending
  std::vector<int> crossing_begin;     // per joint (+1): its first crossing
  std::vector<RowCrossing> crossings;  // of all open loops of the cluster
  std::vector<int> entries;            // matrix entry of each pair (n, m <= n) of crossings of one joint
  int first_crossing = 0;              // index among the crossings of all fronts
  int first_entry = 0;                 // index of the matrix among the entries of all fronts
};

// One step of the leaves-to-root pass: a joint outside all loops, a whole cluster, or one of its fronts.
struct EliminationStep {
  enum class Kind { joint, cluster, front };
  Kind kind = Kind::joint;
  int index = 0;
};

}  // namespace redysim
