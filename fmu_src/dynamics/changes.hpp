#pragma once

#include "math/dual.hpp"
#include "math/spatial.hpp"

// Conversion between vectors of dual numbers and their values and derivatives.

namespace redysim {

inline Vec3<Dual> with(const Vec3<double>& value, const Vec3<double>& change) {
  return {Dual(value.x(), change.x()), Dual(value.y(), change.y()), Dual(value.z(), change.z())};
}

inline Force<double> change_of(const Force<Dual>& f) {
  const auto part = [](const Vec3<Dual>& v) {
    return Vec3<double>(v[0].derivative, v[1].derivative, v[2].derivative);
  };
  return {part(f.moment), part(f.force)};
}

}  // namespace redysim
