#pragma once

#include <vector>

#include "dynamics/loops/cluster_plan.hpp"
#include "model/model.hpp"

namespace redysim {

// The rows of all rigid couplings of a model.
struct CouplingSystem {
  std::vector<CoupledJoints> rows;  // `coupling`: one of the couplings that the row is made of
  // Per coupling of the model, its multiplier as a sum of those of rows.
  std::vector<std::vector<MultiplierPart>> multipliers;
};

// One row for each coupling. Many couplings of two joints each that share joints, such as mimic joints of one
// leader, would be coupled all with all. They are replaced by as many rows between neighbours in the tree,
// which have the same solutions and of which each is coupled to two others only. `parents`, `carrier`: per
// joint and per link of the plan.
CouplingSystem coupling_system(const Model& model, const std::vector<int>& parents,
                               const std::vector<int>& carrier);

}  // namespace redysim
