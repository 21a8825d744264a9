#pragma once

#include <limits>
#include <vector>

#include "integrate/system/system.hpp"

namespace redysim {

// The scale of an acceptable error, component by component: weight = 1 / (rtol |y| + atol scale).
// * The scale of a joint's position and velocity is that of its motions (System::scales).
// * The |q| of a joint that turns is limited to 2 pi: an angle has no scale beyond one revolution.
// * No scale is below a few rounding errors of |y|, which no method can resolve; for a velocity also those of
//   its position (1 rad ~ 1 rad/s).
// * The work has weight 0: energy outputs must not change the trajectory. The same formula and steps
//   integrate it, so its error is of the size of the state's error. With prescribed joints this is not so:
//   the state does not show their forces. Where `weigh_work` follows `evaluate`, the scale of the work is
//   then its size and an energy.
class ErrorWeights {
 public:
  static constexpr double finest = 16 * std::numeric_limits<double>::epsilon();  // relative tolerance

  [[gnu::cold]] ErrorWeights(const System& system, double rtol, double atol);

  // Arrays of System::size(). `share`: of the tolerance.
  void evaluate(const double* y, double* weights, double share = 1) const;
  [[gnu::cold]] void weigh_work(System& system, double time, const double* y, double* weights) const;
  double norm(const double* error, const double* weights) const;  // root mean square of weighted entries

 private:
  const System& system_;
  double rtol_, atol_;
  std::vector<double> cap_;  // upper limit of |y|; one entry per component but the work
  int weighted_ = 0;         // components in the norm: those, and the work of prescribed joints
};

}  // namespace redysim
