#pragma once

#include "dynamics/plan.hpp"

namespace redysim {

// Splits clusters whose loops meet at several bodies into fronts where that is less work, and writes
// Plan::fronts. Uses Plan::joints, loops and clusters. Clusters with prescribed joints stay whole: there a
// row may be moved by nothing, which takes all of its levers to see.
void build_fronts(Plan<double>& plan);

}  // namespace redysim
