#include "integrate/system/spectral_radius.hpp"

#include <cmath>

namespace redysim {
namespace {

constexpr int settling = 6;   // iterations until the dominant eigenvector is reached
constexpr int measured = 12;  // even: x'' = -w^2 x grows by w^2 in two iterations, unevenly in one

}  // namespace

SpectralRadius::SpectralRadius(const System& system)
    : at_(static_cast<std::size_t>(system.size())),
      direction_(at_),
      slope_(at_),
      moved_slope_(at_),
      nudge_(at_) {}

double SpectralRadius::estimate(System& system, double time, const double* y) {
  const std::size_t n = static_cast<std::size_t>(system.layout().work.begin);
  if (system.slope_within_step(time, y, slope_.data()) != Status::ok) return 0;
  system.difference_steps(y, nudge_.data());
  // a direction that contains all eigenvectors
  double angle = 1;
  for (std::size_t i = 0; i < n; ++i, angle += 2.4) direction_[i] = std::sin(angle);
  for (std::size_t i = n; i < at_.size(); ++i) at_[i] = y[i];
  double growth = 1, logarithm = 0;
  for (int k = 0; k < settling + measured; ++k) {
    if (!apply(system, time, y, growth)) return 0;
    if (k >= settling) logarithm += std::log(growth);
  }
  return std::exp(logarithm / measured);
}

// direction <- J direction / |direction|, by a small step; growth = |J direction| / |direction|. The unit of
// each entry is its nudge.
bool SpectralRadius::apply(System& system, double time, const double* y, double& growth) {
  const std::size_t n = static_cast<std::size_t>(system.layout().work.begin);
  double size = 0;
  for (std::size_t i = 0; i < n; ++i) size += direction_[i] * direction_[i];
  size = std::sqrt(size);
  if (!(size > 0) || !std::isfinite(size)) return false;
  for (std::size_t i = 0; i < n; ++i) at_[i] = y[i] + nudge_[i] / size * direction_[i];
  if (system.slope_within_step(time, at_.data(), moved_slope_.data()) != Status::ok) return false;
  double grown = 0;
  for (std::size_t i = 0; i < n; ++i) {
    direction_[i] = (moved_slope_[i] - slope_[i]) / nudge_[i];
    grown += direction_[i] * direction_[i];
  }
  growth = std::sqrt(grown);
  return growth > 0;
}

}  // namespace redysim
