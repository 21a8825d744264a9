#include "dynamics/contact/contact_plan.hpp"

#include <algorithm>

namespace redysim {

ContactPair<double> contact_pair(const Shape& points, const Pose& points_in_body, const Shape& surface,
                                 const Pose& surface_in_body) {
  ContactPair<double> pair;
  const Pose balls = points_in_body * points.frame;
  pair.middle.setZero();
  for (const Vec3<double>& center : ball_centers(points)) {
    pair.balls.push_back(balls.rotation * center + balls.position);
    pair.middle += pair.balls.back();
  }
  pair.middle /= static_cast<double>(pair.balls.size());
  pair.radius = ball_radius(points);
  pair.is_disk = points.kind == ShapeKind::disk;
  pair.axis = balls.rotation.col(2);
  pair.ring = pair.is_disk ? points.radius - points.tube : 0;
  for (const Vec3<double>& ball : pair.balls)
    pair.extent = std::max(pair.extent, (ball - pair.middle).norm());
  pair.extent += pair.radius + pair.ring;
  const Pose frame = surface_in_body * surface.frame;
  pair.surface = {surface.kind,   frame.rotation,      frame.position,       surface.half_size,
                  surface.radius, surface.half_length, surface.heights.get()};
  return pair;
}

}  // namespace redysim
