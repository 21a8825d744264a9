#pragma once

#include "model/parameters.hpp"

namespace redysim {

// The size of the motions of a link's joint, the unit of its absolute tolerance: 1 rad for an angle; at most
// 1 m for a displacement, and 1 m where the model does not determine it (docs/solvers.md).
double motion_scale(const Model& model, const Parameters<double>& parameters, int link);

}  // namespace redysim
