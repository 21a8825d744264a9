#pragma once

#include <algorithm>
#include <vector>

#include "math/vec3.hpp"
#include "model/contact.hpp"

// Contacts in the form of the recursions: spheres on one body against a surface on another.

namespace redysim {

template <class Scalar>
struct Surface {
  ShapeKind kind = ShapeKind::plane;
  Mat3<Scalar> rotation;  // of the surface's frame in the body
  Vec3<Scalar> position;
  Vec3<Scalar> half_size;
  Scalar radius = 0, half_length = 0;
  const BicubicSpline* heights = nullptr;
  Vec3<Scalar> bound;  // finite surface: half the edges of a bounding box in its axes
  Scalar level = 0;    // other surfaces: maximum height along the normal from the body's origin

  bool is_finite() const { return kind != ShapeKind::plane && kind != ShapeKind::heightmap; }
};

template <class Scalar>
struct ContactPair {
  int contact = 0;  // index into Model::contacts
  int sphere_body = -1, surface_body = -1;
  int sphere_entry = -1, surface_entry = -1;  // indices into Workspace::ground
  bool spheres_on_b = false;                  // link b of the contact carries the spheres
  std::vector<Vec3<Scalar>> spheres;          // centers, in the body frame
  Scalar radius = 0;
  double half_way = 0.5;  // position of the forces between both surfaces; 0: at the center of a sphere
  // disk: the sphere is the nearest part of the rim, whose center line has radius `ring`
  bool is_disk = false;
  Vec3<Scalar> axis;
  Scalar ring = 0;
  // bounding sphere of all spheres: center, radius, and distance of the center from the body's origin
  Vec3<Scalar> middle;
  Scalar extent = 0, middle_arm = 0;
  Surface<Scalar> surface;
};

template <class Scalar>
struct ContactLaw {
  bool redysim = false;
  Scalar stiffness = 0, damping = 0, width = 1;
  Scalar friction = 0, excess = 0, per_velocity = 0;  // excess: maximum minus sliding friction
  Scalar rolling = 0, torsion = 0, per_spin = 0;
  Scalar v_max = 0, Ch = 0;
};

// Minimum penetration of ReDySim's law, m.
inline constexpr double redysim_least_depth = 1e-5;

ContactPair<double> contact_pair(const Shape& points, const Pose& points_in_body, const Shape& surface,
                                 const Pose& surface_in_body);

template <class Scalar>
ContactLaw<Scalar> contact_law(bool redysim, const ContactParameters<Scalar>& given) {
  ContactLaw<Scalar> law;
  law.redysim = redysim;
  law.stiffness = given.stiffness;
  law.damping = given.damping;
  law.width = given.width;
  law.friction = given.friction;
  law.excess = std::max(Scalar(0), given.static_friction - given.friction);
  law.per_velocity = Scalar(1) / given.friction_velocity;
  law.rolling = given.rolling;
  law.torsion = given.torsion;
  law.per_spin = Scalar(1) / given.spin_velocity;
  law.v_max = given.v_max;
  law.Ch = given.Ch;
  return law;
}

// Conversion to another scalar type.
template <class To>
ContactLaw<To> with_constants_of(const ContactLaw<double>& from) {
  return {from.redysim,      from.stiffness, from.damping, from.width,    from.friction, from.excess,
          from.per_velocity, from.rolling,   from.torsion, from.per_spin, from.v_max,    from.Ch};
}

template <class To>
ContactPair<To> with_constants_of(const ContactPair<double>& from) {
  ContactPair<To> to;
  to.contact = from.contact;
  to.sphere_body = from.sphere_body;
  to.surface_body = from.surface_body;
  to.sphere_entry = from.sphere_entry;
  to.surface_entry = from.surface_entry;
  to.spheres_on_b = from.spheres_on_b;
  for (const Vec3<double>& sphere : from.spheres) to.spheres.push_back(sphere.cast<To>());
  to.radius = from.radius;
  to.half_way = from.half_way;
  to.is_disk = from.is_disk;
  to.axis = from.axis.cast<To>();
  to.ring = from.ring;
  to.middle = from.middle.cast<To>();
  to.extent = from.extent;
  to.middle_arm = from.middle_arm;
  to.surface = {from.surface.kind,
                from.surface.rotation.cast<To>(),
                from.surface.position.cast<To>(),
                from.surface.half_size.cast<To>(),
                from.surface.radius,
                from.surface.half_length,
                from.surface.heights,
                from.surface.bound.cast<To>(),
                from.surface.level};
  return to;
}

}  // namespace redysim
