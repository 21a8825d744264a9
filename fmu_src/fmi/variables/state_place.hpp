#pragma once

#include "fmi/variables/variables.hpp"
#include "integrate/system/system.hpp"

namespace redysim {

// The place in y of the part of a variable; -1: the model does not integrate it.
int place_of(const System& system, StatePart part, const Variable& variable);

}  // namespace redysim
