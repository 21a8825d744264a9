#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/model.hpp"

namespace redysim {

// A solid for drawings, fixed to a link and ignored by the dynamics. Sizes in m: edges of a box, radius and
// length of a cylinder or capsule along z (for a capsule between the centers of its caps), radius of a
// sphere. For a mesh: scale factors.
struct DrawnShape {
  std::string kind, file;  // file: of a mesh, relative to the folder of the model file
  int link = ground;
  std::vector<double> size;
  Vec3<double> position = Vec3<double>::Zero();
  Mat3<double> rotation = Mat3<double>::Identity();
  std::vector<double> color;  // red, green, blue and opacity, 0 to 1; empty: color of the link
};

// Reads the [[shape]] tables of the file from which `model` was read. Throws ModelError with all errors.
// Separate from read_model_file because the library does not need drawings.
std::vector<DrawnShape> read_shapes(const std::string& path, const Model& model);

}  // namespace redysim
