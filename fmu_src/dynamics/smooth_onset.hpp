#pragma once

#include <cmath>

// Normal force of a stop or contact at depth x > 0 with rate x': k h(x) g(damping x'), where
//   h'' = 6 u (1 - u) / width,  u = min(x / width, 1)    a linear spring for x >= width, C2 at 0
//   g(s) = s + sqrt(1 + s^2)                             about 1 + s for small s (Hunt and Crossley 1975)
// g is always positive, so that the force never pulls.

namespace redysim {

// h(x), m, and its integral, m^2, at x >= 0.
template <class Scalar>
struct SmoothOnset {
  Scalar width, u, behind;

  SmoothOnset(const Scalar& depth, const Scalar& of_width) : width(of_width) {
    u = depth < width ? Scalar(depth / width) : Scalar(1);
    behind = depth - width * u;
  }
  Scalar force() const { return width * u * u * u * (Scalar(1) - Scalar(0.5) * u) + behind; }
  Scalar slope() const { return u * u * (Scalar(3) - Scalar(2) * u); }  // h'
  Scalar energy() const {
    const Scalar soft = width * width * u * u * u * u * (Scalar(0.25) - Scalar(0.1) * u);
    return soft + Scalar(0.5) * behind * (width + behind);
  }
};

// Region of a depth: 0 outside, 1 in the onset, 2 at full stiffness.
inline unsigned onset_region(double depth, double width) {
  return (depth > 0 ? 1u : 0u) + (depth > width ? 1u : 0u);
}

// g(s).
template <class Scalar>
Scalar impact_growth(const Scalar& s) {
  using std::sqrt;
  return s + sqrt(Scalar(1) + s * s);
}

}  // namespace redysim
