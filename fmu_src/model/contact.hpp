#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "math/bicubic_spline.hpp"
#include "model/dh.hpp"

// Contact between a shape on link a and a shape on link b (or ground). Law: docs/contact.md.

namespace redysim {

enum class ShapeKind { points, sphere, capsule, box, disk, plane, heightmap };

// Names of the shapes in the model file.
inline constexpr std::pair<const char*, ShapeKind> shape_kinds[] = {
    {"points", ShapeKind::points},      {"sphere", ShapeKind::sphere},
    {"capsule", ShapeKind::capsule},    {"box", ShapeKind::box},
    {"disk", ShapeKind::disk},          {"plane", ShapeKind::plane},
    {"heightmap", ShapeKind::heightmap}};

const char* word_of(ShapeKind kind);

// `frame` is relative to the frame of the link. Its z axis is the normal of a plane, the line between the end
// centers of a capsule, or the axis of a disk; for a height map its axes are those of the grid.
struct Shape {
  ShapeKind kind = ShapeKind::sphere;
  int link = -1;  // -1: ground
  Pose frame;
  std::vector<Vec3<double>> points;               // in `frame`
  double radius = 0;                              // m; of a disk: outer radius; of a box: of its corners
  double half_length = 0;                         // m, of the axis of a capsule
  double tube = 0;                                // m, radius of the rim of a disk
  Vec3<double> half_size = Vec3<double>::Zero();  // m, of a box
  std::shared_ptr<const BicubicSpline> heights;
};

template <class Scalar>
struct ContactParameters {
  Scalar stiffness = 0;             // N/m; ReDySim's K
  Scalar damping = 0;               // s/m; ReDySim's Cv, N s/m
  Scalar width = 1e-4;              // m
  Scalar friction = 0;              // -; ReDySim's mu
  Scalar static_friction = 0;       // -
  Scalar friction_velocity = 1e-3;  // m/s
  Scalar rolling = 0, torsion = 0;  // m
  Scalar spin_velocity = 1;         // rad/s
  Scalar v_max = 0, Ch = 0;         // for law redysim only; m/s and N s/m

  template <class Other>
  ContactParameters<Other> cast() const {
    const auto to = [](const auto&... numbers) { return ContactParameters<Other>{numbers...}; };
    return to(stiffness, damping, width, friction, static_friction, friction_velocity, rolling, torsion,
              spin_velocity, v_max, Ch);
  }
};

struct Contact : ContactParameters<double> {
  enum class Law { smooth, redysim };

  std::string name;
  Shape a, b;
  Law law = Law::smooth;
  bool shows_force = false, shows_torque = false, shows_depth = false, shows_point = false,
       shows_slip = false;
  int line = 0, column = 0;  // in the model file; 0: not from a file
};

// A shape with contact points and a shape with a surface. Two boxes give two pairs, one for the corners of
// each.
struct ShapePair {
  const Shape* points;
  const Shape* surface;
};

// The pairs of a contact; empty if these shapes cannot be combined.
std::vector<ShapePair> shape_pairs(const Contact& contact);

// Centers of the spheres of a shape, in `frame`, and their common radius in m. The spheres of a box touch its
// faces at the corners. The points of `points` have radius 0. A disk has one sphere: its center, with the
// radius of its rim.
std::vector<Vec3<double>> sphere_centers(const Shape& shape);
double sphere_radius(const Shape& shape);

}  // namespace redysim
