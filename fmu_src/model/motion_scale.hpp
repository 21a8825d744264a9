#pragma once

#include "model/model.hpp"

namespace redysim {

// The size of the motions of a link's joint, in m for a prismatic one: what its absolute tolerance counts in.
// At most 1 m, which it is where nothing in the model tells; an angle's is 1 rad (docs/solvers.md).
double motion_scale(const Model& model, int link);

}  // namespace redysim
