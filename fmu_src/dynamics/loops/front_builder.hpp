#pragma once

#include "dynamics/plan.hpp"

namespace redysim {

// Splits clusters whose loops meet at several bodies into fronts if this needs fewer operations, and fills
// Plan::fronts. Uses Plan::joints, loops and clusters. Clusters with prescribed joints are not split: a row
// may cross only prescribed joints, and detecting this requires all its levers.
void build_fronts(Plan<double>& plan);

}  // namespace redysim
