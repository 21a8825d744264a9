#pragma once

#include <vector>

#include "dynamics/assembly/assembly.hpp"
#include "math/dual.hpp"

namespace redysim {

// Replaces the directions of given start values by those of the assembled ones. q and qd: assembled values
// with the directions of the given values. `assembly`: result of assemble(...). Overwrites positions and
// ground poses of the workspace. Allocates. Returns the reason if there is no derivative, otherwise null.
const char* follow_assembly(const Model& model, const Assembly& assembly, const Plan<Dual>& plan,
                            Workspace<Dual>& ws, std::vector<Dual>& q, std::vector<Dual>& qd);

}  // namespace redysim
