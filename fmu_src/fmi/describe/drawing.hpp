#pragma once

#include "fmi/describe/json.hpp"
#include "model/model.hpp"

namespace redysim {

// Writes gravity, and where links, loops, springs and contact shapes stand at the start pose, in the ground
// frame, SI.
void write_drawing(Json& json, const Model& model);

}  // namespace redysim
