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

// With the words of the model file.
inline constexpr std::pair<const char*, ShapeKind> shape_kinds[] = {
    {"points", ShapeKind::points},      {"sphere", ShapeKind::sphere},
    {"capsule", ShapeKind::capsule},    {"box", ShapeKind::box},
    {"disk", ShapeKind::disk},          {"plane", ShapeKind::plane},
    {"heightmap", ShapeKind::heightmap}};

const char* word_of(ShapeKind kind);

// `frame` is in the frame of the link: of a plane its z axis is the normal, of a height map its axes are
// those of the grid, of a capsule the z axis joins the centers of both ends, of a disk it is the axis.
struct Shape {
  ShapeKind kind = ShapeKind::sphere;
  int link = -1;  // -1: ground
  Pose frame;
  std::vector<Vec3<double>> points;               // in `frame`
  double radius = 0;                              // m; of a disk the outer one
  double half_length = 0;                         // m, of a capsule's axis
  double tube = 0;                                // m, radius of a disk's rim
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
  Scalar v_max = 0, Ch = 0;         // of ReDySim's law, m/s and N s/m

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

// A shape with contact points against one with a surface. Boxes: the corners of each against the other.
struct ShapePair {
  const Shape* points;
  const Shape* surface;
};

// Empty: these shapes cannot be combined.
std::vector<ShapePair> shape_pairs(const Contact& contact);

// Centers of the balls of a shape, in its frame, and their radius: corners of a box and `points` have radius
// 0. A disk has its center and the radius of its rim.
std::vector<Vec3<double>> ball_centers(const Shape& shape);
double ball_radius(const Shape& shape);

}  // namespace redysim
