#pragma once

#include "model/parameters.hpp"

namespace redysim {

// The size of the motion of a link's joint, which is the unit of its absolute tolerance: 1 rad for an angle;
// for a displacement at most 1 m, and 1 m if the model does not determine it (docs/solvers.md).
double motion_scale(const Model& model, const Parameters<double>& parameters, int link);

// The same for a search over long distances: a displacement has at least the size of the moved links.
double search_scale(const Model& model, const Parameters<double>& parameters, int link);

}  // namespace redysim
