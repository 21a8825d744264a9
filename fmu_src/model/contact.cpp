#include "model/contact.hpp"

#include <algorithm>
#include <iterator>

namespace redysim {
namespace {

bool is_terrain(const Shape& shape) {
  return shape.kind == ShapeKind::plane || shape.kind == ShapeKind::heightmap;
}

bool is_solid(const Shape& shape) {
  return shape.kind == ShapeKind::sphere || shape.kind == ShapeKind::capsule || shape.kind == ShapeKind::box;
}

}  // namespace

const char* word_of(ShapeKind kind) {
  const auto same = [kind](const auto& entry) { return entry.second == kind; };
  return std::find_if(std::begin(shape_kinds), std::end(shape_kinds), same)->first;
}

std::vector<ShapePair> shape_pairs(const Contact& contact) {
  const Shape &a = contact.a, &b = contact.b;
  if (is_terrain(a) && is_terrain(b)) return {};
  if (is_terrain(b)) return {{&a, &b}};
  if (is_terrain(a)) return {{&b, &a}};
  if (a.kind == ShapeKind::sphere && is_solid(b)) return {{&a, &b}};
  if (b.kind == ShapeKind::sphere && is_solid(a)) return {{&b, &a}};
  if (a.kind == ShapeKind::box && b.kind == ShapeKind::box) return {{&a, &b}, {&b, &a}};
  return {};
}

std::vector<Vec3<double>> sphere_centers(const Shape& shape) {
  const Vec3<double> half = shape.half_size - Vec3<double>::Constant(shape.radius);  // of a box
  std::vector<Vec3<double>> centers;
  switch (shape.kind) {
    case ShapeKind::points:
      return shape.points;
    case ShapeKind::capsule:
      return {{0, 0, -shape.half_length}, {0, 0, shape.half_length}};
    case ShapeKind::box:
      for (int corner = 0; corner < 8; ++corner)
        centers.emplace_back(corner & 1 ? half.x() : -half.x(), corner & 2 ? half.y() : -half.y(),
                             corner & 4 ? half.z() : -half.z());
      return centers;
    case ShapeKind::sphere:
    case ShapeKind::disk:
      return {Vec3<double>::Zero()};
    case ShapeKind::plane:
    case ShapeKind::heightmap:
      break;
  }
  return {};
}

double sphere_radius(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::sphere:
    case ShapeKind::capsule:
    case ShapeKind::box:
      return shape.radius;
    case ShapeKind::disk:
      return shape.tube;
    default:
      return 0;
  }
}

}  // namespace redysim
