#pragma once

#include <vector>

#include "dynamics/assembly/assembly.hpp"
#include "math/dual.hpp"

namespace redysim {

// How an assembled start follows its start values: q and qd hold the assembled values, and the directions of
// the start values become those of the assembled ones. `assembly` is what assemble(...) returned. Overwrites
// positions and ground poses of the workspace. Allocates. Returns why there is no such direction; null: done.
const char* follow_assembly(const Model& model, const Assembly& assembly, const Plan<Dual>& plan,
                            Workspace<Dual>& ws, std::vector<Dual>& q, std::vector<Dual>& qd);

}  // namespace redysim
