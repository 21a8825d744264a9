#pragma once

#include "dynamics/contact/surface_depth.hpp"
#include "dynamics/ground_motion.hpp"

// Kinematics of contact points: docs/contact.md.

namespace redysim {

// Motion of the balls' body relative to the surface's body, in surface axes.
template <class Scalar>
struct RelativeMotion {
  Mat3<Scalar> axes;    // orientation of the surface in ground axes
  Vec3<Scalar> origin;  // origin of the surface's frame in the ground frame
  Mat3<Scalar> rotation;
  Vec3<Scalar> position, velocity, omega;  // of the body's origin, m, m/s and rad/s

  Vec3<Scalar> point(const Vec3<Scalar>& in_body) const { return position + rotation * in_body; }
  Vec3<Scalar> velocity_at(const Vec3<Scalar>& place) const {
    return velocity + omega.cross(Vec3<Scalar>(place - position));
  }
};

// Not inlined, for size, but with all its calls inlined: the functions themselves are optimised for size.
template <class Scalar>
[[gnu::noinline, gnu::flatten]] RelativeMotion<Scalar> relative_motion(const Surface<Scalar>& surface,
                                                                       const GroundState<Scalar>& balls,
                                                                       const GroundState<Scalar>& carrier) {
  RelativeMotion<Scalar> m;
  m.axes = carrier.rotation * surface.rotation;
  m.origin = carrier.position + carrier.rotation * surface.position;
  const auto into = m.axes.transpose();
  m.rotation = into * balls.rotation;
  m.position = into * Vec3<Scalar>(balls.position - m.origin);
  const Vec3<Scalar> arm = balls.position - carrier.position;
  m.velocity = into * Vec3<Scalar>(balls.velocity - carrier.velocity - carrier.omega.cross(arm));
  m.omega = into * Vec3<Scalar>(balls.omega - carrier.omega);
  return m;
}

// One contact point in the frame of the surface. `position`: half way between both surfaces (ReDySim's law:
// the point itself). `slip`, `spin`: relative motion of the bodies there. `rate` = -normal . velocity.
// `growth`: time derivative of the depth, which differs from `rate` on curved ground. `velocity`: of the
// ball's center.
template <class Scalar>
struct Touch {
  Scalar depth, rate, growth;
  Vec3<Scalar> normal, position, slip, spin, velocity;
  std::size_t ball;  // index into ContactPair::balls
};

// Time derivative of the unit normal of a surface below p, which moves with `velocity`.
template <class Scalar>
Vec3<Scalar> normal_rate(const Surface<Scalar>& surface, const Vec3<Scalar>& p, const Vec3<Scalar>& normal,
                         const Vec3<Scalar>& velocity) {
  if (surface.kind != ShapeKind::heightmap) return Vec3<Scalar>::Zero();
  const auto at = surface.heights->at(Scalar(p.x()), Scalar(p.y()));
  const Vec3<Scalar> steepening(-(at.zxx * velocity.x() + at.zxy * velocity.y()),
                                -(at.zxy * velocity.x() + at.zyy * velocity.y()), Scalar(0));
  return normal.z() * Vec3<Scalar>(steepening - normal * normal.dot(steepening));
}

// Replaces the center of a disk and its rate by those of the cross section of the rim that is lowest along
// the normal below the center.
template <class Scalar>
[[gnu::cold]] void move_to_rim(const ContactPair<Scalar>& pair, const RelativeMotion<Scalar>& motion,
                               Vec3<Scalar>& center, Vec3<Scalar>& rate) {
  const Vec3<Scalar> normal = surface_depth(pair.surface, center).normal;
  const Vec3<Scalar> turning = normal_rate(pair.surface, center, normal, rate);
  const Vec3<Scalar> axis = motion.rotation * pair.axis, axis_rate = motion.omega.cross(axis);
  const Scalar tilt = normal.dot(axis);
  const Vec3<Scalar> up = normal - tilt * axis;
  const Vec3<Scalar> up_rate =
      turning - (turning.dot(axis) + normal.dot(axis_rate)) * axis - tilt * axis_rate;
  const Scalar size = safe_norm(up);
  const Vec3<Scalar> direction = up / size;
  center -= pair.ring * direction;
  rate -= (pair.ring / size) * Vec3<Scalar>(up_rate - direction * direction.dot(up_rate));
}

// Not inlined, for size: called for a few points only.
template <class Scalar>
[[gnu::noinline]] Touch<Scalar> touch_of(const ContactPair<Scalar>& pair,
                                         const RelativeMotion<Scalar>& motion, const Vec3<Scalar>& ball) {
  Vec3<Scalar> center = motion.point(ball), rate = motion.velocity_at(center);
  if (pair.is_disk) move_to_rim(pair, motion, center, rate);
  SurfaceDepth<Scalar> surface = surface_depth(pair.surface, center);
  pass_crests(pair.surface, center, surface);
  Touch<Scalar> touch;
  touch.depth = surface.depth + pair.radius;
  touch.normal = surface.normal;
  touch.position = center + Scalar(pair.half_way) * (surface.depth - pair.radius) * surface.normal;
  const Vec3<Scalar> velocity = motion.velocity_at(touch.position);
  touch.rate = -surface.normal.dot(velocity);
  touch.growth = surface.gradient.dot(rate);
  touch.velocity = rate;
  touch.slip = velocity + surface.normal * touch.rate;
  touch.spin = motion.omega;
  touch.ball = static_cast<std::size_t>(&ball - pair.balls.data());
  return touch;
}

// Calls visit(touch, motion) for each ball of a pair.
template <class Scalar, class Visit>
void visit_touches(const ContactPair<Scalar>& pair, const Workspace<Scalar>& ws, Visit visit) {
  const RelativeMotion<Scalar> motion =
      relative_motion(pair.surface, ground_state(ws, pair.ball_entry), ground_state(ws, pair.surface_entry));
  for (const Vec3<Scalar>& ball : pair.balls) visit(touch_of(pair, motion, ball), motion);
}

}  // namespace redysim
