#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/model.hpp"

namespace redysim {

// A solid of the drawing, fixed to a link; the dynamics ignore it. Sizes in m: edges of a box, radius and
// length of a cylinder or capsule (its axis is z; the length of a capsule is that between the centers of its
// caps), radius of a sphere, scale factors of a mesh.
struct DrawnShape {
  std::string kind, file;  // file: of a mesh, relative to the model file
  int link = ground;
  std::vector<double> size;
  Vec3<double> position = Vec3<double>::Zero();
  Mat3<double> rotation = Mat3<double>::Identity();
  std::vector<double> color;  // red, green, blue and opacity, 0 to 1; empty: that of the link
};

// Reads the [[shape]] tables of the file that `model` was read from; throws ModelError with all errors. Not
// part of read_model_file, because the library has no use for them.
std::vector<DrawnShape> read_shapes(const std::string& path, const Model& model);

}  // namespace redysim
