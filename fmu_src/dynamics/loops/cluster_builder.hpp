#pragma once

#include "dynamics/plan.hpp"

namespace redysim {

// Groups the model's loops and rigid couplings into clusters: fills loops, couplings, clusters, fronts and
// both elimination orders of the plan. Uses the plan's joints and carriers. Called once at load.
void build_clusters(const Model& model, Plan<double>& plan);

}  // namespace redysim
