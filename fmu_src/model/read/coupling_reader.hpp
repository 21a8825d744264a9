#pragma once

#include <vector>

#include "model/model.hpp"
#include "model/read/names.hpp"

// [[coupling]] tables.

namespace redysim {

// Reads couplings between joints of `model.links`. Rigid couplings that contradict each other are errors;
// redundant ones cause a warning.
std::vector<Coupling> read_couplings(Section& top, const Model& model, Names& names, Findings& findings);

}  // namespace redysim
