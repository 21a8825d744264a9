#pragma once

#include "dynamics/plan.hpp"

namespace redysim {

// Groups the model's loops into clusters and writes Plan::loops, clusters, elimination and needs_pose.
// Uses the plan's joints, springs, carriers. Called once at load.
template <class Scalar>
void build_clusters(const Model& model, Plan<Scalar>& plan);

}  // namespace redysim
