#include "integrate/methods/first_step.hpp"

#include <algorithm>
#include <cmath>

namespace redysim {

double first_step(System& system, const ErrorWeights& error_weights, int order, double time, const double* y,
                  const double* f0, double step_limit, FirstStepScratch& scratch) {
  const std::size_t n = scratch.probe.size();
  error_weights.evaluate(y, scratch.weights.data());
  const double size_y = error_weights.norm(y, scratch.weights.data());
  const double size_f = error_weights.norm(f0, scratch.weights.data());

  // an explicit Euler step that changes the state by about a hundredth
  double h = size_y < 1e-5 || size_f < 1e-5 ? 1e-6 : 0.01 * size_y / size_f;
  h = std::min(h, step_limit);
  for (int attempt = 0;; ++attempt, h *= 0.1) {
    if (attempt == 12 || !(h > 0)) return 0;
    for (std::size_t i = 0; i < n; ++i) scratch.probe[i] = y[i] + h * f0[i];
    if (system.right_hand_side(time + h, scratch.probe.data(), scratch.slope.data()) == Status::ok) break;
  }

  // the step whose error h^(order+1) times the second derivative is a hundredth of the tolerance
  for (std::size_t i = 0; i < n; ++i) scratch.slope[i] = (scratch.slope[i] - f0[i]) / h;
  const double curvature = error_weights.norm(scratch.slope.data(), scratch.weights.data());
  // for order 1 the leading error term h^2/2 y'' is known, for higher orders only estimated
  const double largest_term = order == 1 ? curvature : std::max(size_f, curvature);
  const double share = order == 1 ? 0.5 : 0.01;
  const double by_curvature =
      largest_term > 1e-15 ? std::pow(share / largest_term, 1.0 / (order + 1)) : std::max(1e-6, 1e-3 * h);
  return std::min({100 * h, by_curvature, step_limit});
}

}  // namespace redysim
