#pragma once

#include <limits>
#include <vector>

#include "integrate/system/system.hpp"

namespace redysim {

// Error weights by component: weight = 1 / (rtol |y| + atol scale).
// * The scale of a joint's position and velocity is that of its motions (System::scales).
// * The |q| of a joint that turns is limited to 2 pi: an angle has no scale beyond one revolution.
// * No tolerance is below a few rounding errors of |y|, which no method can resolve; for a velocity also
// those of its position (1 rad ~ 1 rad/s).
// * The work has weight 0: energy outputs must not change the trajectory. It is integrated by the same
// formula and steps, so its error is similar to that of the state. This does not hold for prescribed joints,
// whose forces do not appear in the state. With these, call `weigh_work` after `evaluate`: the work is then
// weighted by its size and an energy.
class ErrorWeights {
 public:
  static constexpr double finest = 16 * std::numeric_limits<double>::epsilon();  // minimum relative tolerance

  [[gnu::cold]] ErrorWeights(const System& system, double rtol, double atol);

  // Sets the weights at y, both of length System::size(), with the tolerances times `share`.
  void evaluate(const double* y, double* weights, double share = 1) const;
  [[gnu::cold]] void weigh_work(System& system, double time, const double* y, double* weights) const;
  double norm(const double* error, const double* weights) const;  // root mean square of weighted entries

 private:
  const System& system_;
  double rtol_, atol_;
  std::vector<double> cap_;  // upper limit of |y|, per component without the work
  int weighted_ = 0;         // number of components in the norm, including the work of prescribed joints
};

}  // namespace redysim
