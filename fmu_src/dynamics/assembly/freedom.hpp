#pragma once

#include <vector>

#include "dynamics/loops/cluster_rows.hpp"

namespace redysim {

// Ranks of the constraints of each cluster of a plan with respect to some joints, at q (per joint of the
// plan).
struct ConstraintRanks {
  std::vector<int> ranks, joints;  // per cluster; joints: number of free joints
  bool are_full = true;            // ranks equal the number of rows or of joints
  double gap = 0;                  // maximum residual, relative to the size of the mechanism, or in rad
};
// `smallest`: minimum significant pivot of J, in units of the joints. Allocates.
ConstraintRanks constraint_ranks(const Model& model, const Plan<double>& plan, const double* q,
                                 FreeJoints free, double smallest);

// Degrees of freedom of a system with prescribed motions and closed loops in one configuration:
// motions - surplus + left = system.
struct Freedom {
  int motions = 0;  // prescribed joints
  int system = 0;   // degrees of freedom if no joint is prescribed
  int left = 0;     // degrees of freedom that are not prescribed
  int surplus = 0;  // motions that depend on others and must be consistent with the loops
};

// Determined by ranks at q: the result differs in singular configurations. Allocates.
Freedom freedom(const Model& model, const Plan<double>& plan, const double* q);

}  // namespace redysim
