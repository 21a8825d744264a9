#include "integrate/methods/error_weights.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace redysim {
namespace {

constexpr double finest = 16 * std::numeric_limits<double>::epsilon();  // of |y|

}  // namespace

ErrorWeights::ErrorWeights(const System& system, double rtol, double atol)
    : system_(system), rtol_(rtol), atol_(atol), size_(static_cast<std::size_t>(system.size())) {
  constexpr double turn = 6.283185307179586;
  cap_.assign(static_cast<std::size_t>(system.nq() + system.nv()), std::numeric_limits<double>::max());
  for (int i = 0; i < system.simple(); ++i)
    if (!system.plan().joints[system.joint_of(i)].prismatic) cap_[i] = turn;
}

void ErrorWeights::evaluate(const double* y, double* weights, double share) const {
  const double rtol = share * rtol_, atol = share * atol_;
  const auto weight = [&](std::size_t i, double scale, double least) {
    const double size = std::fabs(y[i]);
    weights[i] = 1.0 / std::max({rtol * std::min(size, cap_[i]) + atol * scale, finest * size, least});
  };
  const auto simple = static_cast<std::size_t>(system_.simple()), nq = static_cast<std::size_t>(system_.nq());
  for (std::size_t k = 0; k < simple; ++k) {
    const double scale = system_.scales()[k];
    weight(k, scale, 0);
    weight(nq + k, scale, finest * std::fabs(y[k]));
  }
  for (std::size_t i = simple; i < nq; ++i) weight(i, 1, 0);
  for (std::size_t i = nq + simple; i < cap_.size(); ++i) weight(i, 1, 0);
  for (std::size_t i = cap_.size(); i < size_; ++i) weights[i] = 0;
}

double ErrorWeights::norm(const double* error, const double* weights) const {
  double sum = 0;
  for (std::size_t i = 0; i < cap_.size(); ++i) sum += error[i] * weights[i] * error[i] * weights[i];
  return cap_.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(cap_.size()));
}

}  // namespace redysim
