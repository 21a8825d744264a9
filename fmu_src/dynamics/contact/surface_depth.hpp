#pragma once

#include <limits>

#include "dynamics/contact/contact_plan.hpp"

// Depth of points below the surfaces of contacts; everything in the frame of the surface.

namespace redysim {

// Depth, m (negative: distance), outward unit normal and gradient of the depth. The gradient is -normal,
// except on height maps, where the depth (z - p_z) n_z is not a distance. `region`: number of the face of a
// box that is nearest to a point inside of it, otherwise 0.
template <class Scalar>
struct SurfaceDepth {
  Scalar depth;
  Vec3<Scalar> normal, gradient;
  int region = 0;
};

template <class Scalar>
SurfaceDepth<Scalar> depth_below(const Scalar& radius, const Vec3<Scalar>& from_center) {
  const Scalar distance = safe_norm(from_center);
  const Vec3<Scalar> normal = from_center / distance;
  return {radius - distance, normal, -normal};
}

// Along the vertical, times the vertical part of the normal.
template <class Scalar>
[[gnu::noinline]] SurfaceDepth<Scalar> depth_in_heights(const BicubicSpline& heights, const Vec3<Scalar>& p) {
  using std::sqrt;
  const auto at = heights.at(Scalar(p.x()), Scalar(p.y()));
  const Scalar n_z = Scalar(1) / sqrt(Scalar(1) + at.zx * at.zx + at.zy * at.zy), above = at.z - p.z();
  const Scalar curved = n_z * n_z * n_z * above;
  SurfaceDepth<Scalar> out;
  out.depth = above * n_z;
  out.normal = Vec3<Scalar>(-at.zx * n_z, -at.zy * n_z, n_z);
  out.gradient = -out.normal;
  out.gradient.x() -= curved * (at.zx * at.zxx + at.zy * at.zxy);
  out.gradient.y() -= curved * (at.zx * at.zxy + at.zy * at.zyy);
  out.gradient.z() = -n_z;
  return out;
}

// Replaces the distance from a height map by that from its highest point where this is larger: beside crests.
template <class Scalar>
void pass_crests(const Surface<Scalar>& surface, const Vec3<Scalar>& p, SurfaceDepth<Scalar>& to) {
  if (surface.kind != ShapeKind::heightmap) return;
  const Scalar from_highest(surface.heights->highest() - p.z());
  if (!(from_highest < Scalar(0) && from_highest < to.depth)) return;
  const Vec3<Scalar> up = Vec3<Scalar>::UnitZ();
  to = {from_highest, up, -up};
}

// Outside a box, relative to its nearest point; inside, to its nearest face.
template <class Scalar>
SurfaceDepth<Scalar> depth_in_box(const Vec3<Scalar>& half_size, const Vec3<Scalar>& p) {
  Vec3<Scalar> outside = Vec3<Scalar>::Zero(), normal = Vec3<Scalar>::Zero();
  Scalar least = Scalar(std::numeric_limits<double>::max());
  bool inside = true;
  int face = 0;
  for (int k = 0; k < 3; ++k) {
    const Scalar side = p[k] < Scalar(0) ? Scalar(-1) : Scalar(1), depth = half_size[k] - side * p[k];
    if (depth < Scalar(0)) {
      inside = false;
      outside[k] = -side * depth;
    }
    if (depth < least) {
      least = depth;
      face = k;
    }
  }
  if (!inside) return depth_below(Scalar(0), outside);
  const int side = p[face] < Scalar(0) ? -1 : 1;
  normal[face] = Scalar(side);
  return {least, normal, -normal, 2 + 3 * face + side};
}

template <class Scalar>
SurfaceDepth<Scalar> surface_depth(const Surface<Scalar>& surface, const Vec3<Scalar>& p) {
  switch (surface.kind) {
    case ShapeKind::heightmap:
      return depth_in_heights(*surface.heights, p);
    case ShapeKind::capsule: {
      const Scalar& half = surface.half_length;
      const Scalar along = p.z() < -half ? Scalar(-half) : p.z() > half ? half : Scalar(p.z());
      return depth_below(surface.radius, Vec3<Scalar>(p.x(), p.y(), p.z() - along));
    }
    case ShapeKind::box:
      return depth_in_box(surface.half_size, p);
    case ShapeKind::sphere:
      return depth_below(surface.radius, p);
    default: {
      const Vec3<Scalar> up = Vec3<Scalar>::UnitZ();
      return {-p.z(), up, -up};
    }
  }
}

}  // namespace redysim
