#pragma once

#include "fmi/describe/json.hpp"
#include "model/model.hpp"
#include "model/read/shape_reader.hpp"

namespace redysim {

// Writes gravity and the start poses of links, loops, springs, contact shapes and drawn shapes, in the ground
// frame, SI units.
void write_drawing(Json& json, const Model& model, const std::vector<DrawnShape>& shapes);

}  // namespace redysim
