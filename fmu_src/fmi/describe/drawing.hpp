#pragma once

#include "fmi/describe/json.hpp"
#include "model/model.hpp"
#include "model/read/shape_reader.hpp"

namespace redysim {

// Writes gravity, and where links, loops, springs, contact shapes and drawn shapes stand at the start pose,
// in the ground frame, SI.
void write_drawing(Json& json, const Model& model, const std::vector<DrawnShape>& shapes);

}  // namespace redysim
