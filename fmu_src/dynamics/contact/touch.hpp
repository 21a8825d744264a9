#pragma once

#include "dynamics/contact/surface_depth.hpp"
#include "dynamics/ground_motion.hpp"

// Kinematics of contact points: docs/contact.md.

namespace redysim {

// Motion of the spheres' body relative to the surface's body, in surface axes.
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
                                                                       const GroundState<Scalar>& spheres,
                                                                       const GroundState<Scalar>& carrier) {
  RelativeMotion<Scalar> m;
  m.axes = carrier.rotation * surface.rotation;
  m.origin = carrier.position + carrier.rotation * surface.position;
  const auto into = m.axes.transpose();
  m.rotation = into * spheres.rotation;
  m.position = into * Vec3<Scalar>(spheres.position - m.origin);
  const Vec3<Scalar> arm = spheres.position - carrier.position;
  m.velocity = into * Vec3<Scalar>(spheres.velocity - carrier.velocity - carrier.omega.cross(arm));
  m.omega = into * Vec3<Scalar>(spheres.omega - carrier.omega);
  return m;
}

// One contact point in the frame of the surface. `position`: half way between both surfaces (ReDySim's law:
// the point itself). `slip`, `spin`: relative motion of the bodies there. `approach`: speed along the inward
// normal, which differs from the rate of the depth on curved ground.
template <class Scalar>
struct Touch {
  Scalar depth, depth_rate, approach;
  Vec3<Scalar> normal, position, slip, spin, center_velocity;
  std::size_t sphere;  // index into ContactPair::spheres
  int surface_region;  // as SurfaceDepth::region
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

// Replaces the center of a disk and its velocity by those of the cross section of the rim that is lowest
// along the normal below the center.
template <class Scalar>
[[gnu::cold]] void move_to_rim(const ContactPair<Scalar>& pair, const RelativeMotion<Scalar>& motion,
                               Vec3<Scalar>& center, Vec3<Scalar>& velocity) {
  const Vec3<Scalar> normal = surface_depth(pair.surface, center).normal;
  const Vec3<Scalar> turning = normal_rate(pair.surface, center, normal, velocity);
  const Vec3<Scalar> axis = motion.rotation * pair.axis, axis_rate = motion.omega.cross(axis);
  const Scalar tilt = normal.dot(axis);
  const Vec3<Scalar> up = normal - tilt * axis;
  const Vec3<Scalar> up_rate =
      turning - (turning.dot(axis) + normal.dot(axis_rate)) * axis - tilt * axis_rate;
  const Scalar size = safe_norm(up);
  const Vec3<Scalar> direction = up / size;
  center -= pair.ring * direction;
  velocity -= (pair.ring / size) * Vec3<Scalar>(up_rate - direction * direction.dot(up_rate));
}

// Not inlined, for size: called for a few points only.
template <class Scalar>
[[gnu::noinline]] Touch<Scalar> touch_of(const ContactPair<Scalar>& pair,
                                         const RelativeMotion<Scalar>& motion, const Vec3<Scalar>& sphere) {
  Vec3<Scalar> center = motion.point(sphere), center_velocity = motion.velocity_at(center);
  if (pair.is_disk) move_to_rim(pair, motion, center, center_velocity);
  SurfaceDepth<Scalar> surface = surface_depth(pair.surface, center);
  pass_crests(pair.surface, center, surface);
  Touch<Scalar> touch;
  touch.depth = surface.depth + pair.radius;
  touch.normal = surface.normal;
  touch.position = center + Scalar(pair.half_way) * (surface.depth - pair.radius) * surface.normal;
  const Vec3<Scalar> velocity = motion.velocity_at(touch.position);
  touch.approach = -surface.normal.dot(velocity);
  touch.depth_rate = surface.gradient.dot(center_velocity);
  touch.center_velocity = center_velocity;
  touch.slip = velocity + surface.normal * touch.approach;
  touch.spin = motion.omega;
  touch.surface_region = surface.region;
  touch.sphere = static_cast<std::size_t>(&sphere - pair.spheres.data());
  return touch;
}

// Calls visit(touch, motion) for each sphere of a pair.
template <class Scalar, class Visit>
void visit_touches(const ContactPair<Scalar>& pair, const Workspace<Scalar>& ws, Visit visit) {
  const RelativeMotion<Scalar> motion = relative_motion(pair.surface, ground_state(ws, pair.sphere_entry),
                                                        ground_state(ws, pair.surface_entry));
  for (const Vec3<Scalar>& sphere : pair.spheres) visit(touch_of(pair, motion, sphere), motion);
}

}  // namespace redysim
