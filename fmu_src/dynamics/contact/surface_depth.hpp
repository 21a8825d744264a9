#pragma once

#include "dynamics/contact/contact_plan.hpp"

// Depth of points below the surfaces of contacts; everything in the frame of the surface.

namespace redysim {

// Depth, m (negative: distance), outward unit normal and gradient of the depth. The gradient is -normal,
// except on height maps, where the depth (z - p_z) n_z is not a distance, and on ledges of boxes. `region`:
// number of the face of a box and its ledge on which a point inside presses, otherwise 0.
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

// A face of a box, with the normal `side` (1 or -1) times an axis; axis -1: none.
struct BoxFace {
  int axis = -1, side = 1;
};

// Outside a box, relative to its nearest point; inside, to the face `pressed` or, if there is none, to the
// nearest one. With `pressed`: corners on an edge must be supported like those inside, so the box is wider by
// a ledge, over which the depth decreases to zero.
template <class Scalar>
[[gnu::cold]] SurfaceDepth<Scalar> depth_in_box(const Surface<Scalar>& box, const Vec3<Scalar>& p,
                                                BoxFace pressed) {
  const double ledge = pressed.axis < 0 ? 0 : box.ledge;
  SurfaceDepth<Scalar> out;
  Vec3<Scalar> below;  // each face
  bool inside = true;
  int sides[3], face = 0, edge = 0;
  for (int k = 0; k < 3; ++k) {
    const bool is_pressed = k == pressed.axis;
    sides[k] = is_pressed ? pressed.side : p[k] < Scalar(0) ? -1 : 1;
    below[k] = box.half_size[k] - sides[k] * p[k];
    if (!is_pressed) below[k] += ledge;
    out.normal[k] = Scalar(0);
    if (below[k] < Scalar(0)) {
      inside = false;
      out.normal[k] = -sides[k] * below[k];
    }
    if (is_pressed || (face != pressed.axis && below[k] < below[face])) face = k;
    if (edge == pressed.axis || (!is_pressed && below[k] < below[edge])) edge = k;
  }
  if (!inside) return depth_below(Scalar(0), out.normal);
  out.depth = below[face];
  out.normal[face] = Scalar(sides[face]);
  out.gradient = -out.normal;
  out.region = 2 + 3 * face + sides[face];  // 1 to 9
  if (!(below[edge] < Scalar(ledge))) return out;
  out.region += 9;
  const Scalar share = below[edge] / ledge;
  out.gradient *= share;
  out.gradient[edge] = Scalar(-sides[edge]) * out.depth / ledge;
  out.depth *= share;
  return out;
}

// `pressed`: of a box.
template <class Scalar>
SurfaceDepth<Scalar> surface_depth(const Surface<Scalar>& surface, const Vec3<Scalar>& p,
                                   BoxFace pressed = {}) {
  switch (surface.kind) {
    case ShapeKind::heightmap:
      return depth_in_heights(*surface.heights, p);
    case ShapeKind::capsule: {
      const Scalar& half = surface.half_length;
      const Scalar along = p.z() < -half ? Scalar(-half) : p.z() > half ? half : Scalar(p.z());
      return depth_below(surface.radius, Vec3<Scalar>(p.x(), p.y(), p.z() - along));
    }
    case ShapeKind::box:
      return depth_in_box(surface, p, pressed);
    case ShapeKind::sphere:
      return depth_below(surface.radius, p);
    default: {
      const Vec3<Scalar> up = Vec3<Scalar>::UnitZ();
      return {-p.z(), up, -up};
    }
  }
}

}  // namespace redysim
