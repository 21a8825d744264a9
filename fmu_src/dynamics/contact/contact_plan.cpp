#include "dynamics/contact/contact_plan.hpp"

#include <algorithm>

namespace redysim {

namespace {

Surface<double> surface_plan(const Shape& shape, const Pose& frame) {
  Surface<double> surface;
  surface.kind = shape.kind;
  surface.rotation = frame.rotation;
  surface.position = frame.position;
  surface.half_size = shape.half_size;
  surface.radius = shape.radius;
  surface.half_length = shape.half_length;
  surface.heights = shape.heights.get();
  surface.bound = surface.half_size + Vec3<double>::Constant(surface.radius);
  surface.bound.z() += surface.half_length;
  surface.level = surface.rotation.col(2).dot(surface.position);
  if (surface.heights) surface.level += surface.heights->highest();
  return surface;
}

}  // namespace

ContactPair<double> contact_pair(const Shape& points, const Pose& points_in_body, const Shape& surface,
                                 const Pose& surface_in_body) {
  ContactPair<double> pair;
  const Pose spheres = points_in_body * points.frame;
  pair.middle.setZero();
  for (const Vec3<double>& center : sphere_centers(points)) {
    pair.spheres.push_back(spheres.rotation * center + spheres.position);
    pair.middle += pair.spheres.back();
  }
  pair.middle /= static_cast<double>(pair.spheres.size());
  pair.middle_arm = pair.middle.norm();
  pair.radius = sphere_radius(points);
  pair.is_disk = points.kind == ShapeKind::disk;
  pair.axis = spheres.rotation.col(2);
  pair.ring = pair.is_disk ? points.radius - points.tube : 0;
  for (const Vec3<double>& sphere : pair.spheres)
    pair.extent = std::max(pair.extent, (sphere - pair.middle).norm());
  pair.extent += pair.radius + pair.ring;
  pair.surface = surface_plan(surface, surface_in_body * surface.frame);
  return pair;
}

}  // namespace redysim
