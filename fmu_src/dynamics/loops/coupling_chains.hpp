#pragma once

#include <vector>

#include "dynamics/loops/cluster_plan.hpp"
#include "model/model.hpp"

namespace redysim {

// The rows of all rigid couplings of a model.
struct CouplingSystem {
  std::vector<CoupledJoints> rows;  // `coupling`: one of the couplings that form the row
  // Per coupling of the model: its multiplier as a sum of multipliers of rows.
  std::vector<std::vector<MultiplierPart>> multipliers;
};

// The rows of all rigid couplings, usually one per coupling. Many couplings of two joints each that share
// joints, such as mimic joints of one leader, would all be coupled with each other. They are replaced by the
// same number of rows between neighbours in the tree, which have the same solutions; each is coupled to only
// two others. `parents`: per joint of the plan; `carrier`: per link.
CouplingSystem coupling_system(const Model& model, const std::vector<int>& parents,
                               const std::vector<int>& carrier);

}  // namespace redysim
