#pragma once

#include <cmath>

#include "dynamics/smooth_onset.hpp"

// Spring and damper in parallel, of a coupling or a gear: force F(y, y') for the stretch y. Without backlash
// F = k y + c y'. With backlash, at depth x = |y| - backlash / 2:
//   F = sign(y) k h(x) + c h'(x) y'        h: dynamics/smooth_onset.hpp; 0 within the backlash

namespace redysim {

template <class Number>
struct ElasticLawOf {
  Number stiffness = 0, damping = 0;
  Number half_play = 0, width = 0;  // backlash / 2 (0: none), depth at which it reaches full stiffness

  // Index of the region between the corners of backlash: within it, in the onset or beyond.
  unsigned region(double stretch) const { return onset_region(std::fabs(stretch) - half_play, width); }
};
using ElasticLaw = ElasticLawOf<double>;

// The two parts of F, the stored energy (J) and the dissipation (W, never positive).
template <class Scalar>
struct ElasticForce {
  Scalar elastic{0}, damping{0}, energy{0}, loss{0};

  template <class Number>
  ElasticForce(const ElasticLawOf<Number>& law, const Scalar& y, const Scalar& rate) {
    damping = law.damping * rate;
    if (law.half_play > 0) {
      const bool positive = y > Scalar(0);
      const Scalar depth = (positive ? y : Scalar(-y)) - law.half_play;
      const SmoothOnset<Scalar> onset(depth > Scalar(0) ? depth : Scalar(0), Scalar(law.width));
      damping *= onset.slope();
      elastic = law.stiffness * onset.force() * (positive ? 1.0 : -1.0);
      energy = law.stiffness * onset.energy();
    } else {
      elastic = law.stiffness * y;
      energy = 0.5 * law.stiffness * y * y;
    }
    loss = -(damping * rate);
  }

  Scalar sum() const { return elastic + damping; }
};

}  // namespace redysim
