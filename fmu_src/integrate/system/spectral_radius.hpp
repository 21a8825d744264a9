#pragma once

#include <vector>

#include "integrate/system/system.hpp"

namespace redysim {

// Estimates the spectral radius (1/s) of d(ydot)/dy with an error of some tens of percent, by power iteration
// with differences of right-hand sides, without a matrix.
class SpectralRadius {
 public:
  explicit SpectralRadius(const System& system);

  static constexpr int evaluations = 19;                          // maximum, per call of `estimate`
  double estimate(System& system, double time, const double* y);  // 0: failed

 private:
  bool apply(System& system, double time, const double* y, double& growth);

  std::vector<double> at_, direction_, slope_, moved_slope_, nudge_;
};

}  // namespace redysim
