#pragma once

#include <vector>

#include "dynamics/loops/cluster_rows.hpp"

namespace redysim {

// Ranks of the constraints of each cluster of a plan by some of its joints, at q (per joint of the plan).
struct ConstraintRanks {
  std::vector<int> ranks, joints;  // per cluster; joints: of those that are free
  bool are_full = true;            // as many as rows or joints
  double gap = 0;                  // largest residual, relative to the size of the mechanism, or rad
};
// `smallest`: a pivot of J, in units of the joints, that counts. Allocates.
ConstraintRanks constraint_ranks(const Model& model, const Plan<double>& plan, const double* q,
                                 FreeJoints free, double smallest);

// Degrees of freedom of a system with prescribed motions and closed loops in one configuration:
// motions - surplus + left = system.
struct Freedom {
  int motions = 0;  // prescribed joints
  int system = 0;   // degrees of freedom with all joints free
  int left = 0;     // of these not prescribed, integrated
  int surplus = 0;  // motions determined by the others, which must be consistent with the loops
};

// From ranks at q, so singular configurations have their own result. Allocates.
Freedom freedom(const Model& model, const Plan<double>& plan, const double* q);

}  // namespace redysim
