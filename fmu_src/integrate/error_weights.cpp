#include "integrate/error_weights.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace redysim {
namespace {

constexpr double finest = 16 * std::numeric_limits<double>::epsilon();  // of |y|

}  // namespace

ErrorWeights::ErrorWeights(const System& system, double rtol, double atol)
    : rtol_(rtol),
      atol_(atol),
      nq_(system.nq()),
      simple_(system.simple()),
      size_(static_cast<std::size_t>(system.size())) {
  constexpr double turn = 6.283185307179586;
  cap_.assign(static_cast<std::size_t>(system.nq() + system.nv()), std::numeric_limits<double>::max());
  for (int i = 0; i < system.simple(); ++i)
    if (!system.plan().joints[system.joint_of(i)].prismatic) cap_[i] = turn;
}

void ErrorWeights::evaluate(const double* y, double* weights, double share) const {
  const double rtol = share * rtol_, atol = share * atol_;
  for (std::size_t i = 0; i < cap_.size(); ++i) {
    const double size = std::fabs(y[i]);
    weights[i] = 1.0 / std::max(rtol * std::min(size, cap_[i]) + atol, finest * size);
  }
  for (int k = 0; k < simple_; ++k)
    weights[nq_ + k] = std::min(weights[nq_ + k], 1.0 / (finest * std::fabs(y[k])));
  for (std::size_t i = cap_.size(); i < size_; ++i) weights[i] = 0;
}

double ErrorWeights::norm(const double* error, const double* weights) const {
  double sum = 0;
  for (std::size_t i = 0; i < cap_.size(); ++i) sum += error[i] * weights[i] * error[i] * weights[i];
  return cap_.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(cap_.size()));
}

}  // namespace redysim
