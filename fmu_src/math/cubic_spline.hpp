#pragma once

#include <vector>

namespace redysim {

// Slopes at the knots x of the cubic spline through the values y. The second derivative is continuous, and
// the slope is zero at both ends.
inline std::vector<double> spline_slopes(const std::vector<double>& x, const std::vector<double>& y) {
  const std::size_t n = x.size();
  std::vector<double> slope(n, 0.0), factor(n, 0.0);
  // s[k-1] / h0 + 2 (1/h0 + 1/h1) s[k] + s[k+1] / h1 = 3 (dy0 / h0^2 + dy1 / h1^2), solved by elimination
  for (std::size_t k = 1; k + 1 < n; ++k) {
    const double h0 = x[k] - x[k - 1], h1 = x[k + 1] - x[k];
    const double right = 3 * ((y[k] - y[k - 1]) / (h0 * h0) + (y[k + 1] - y[k]) / (h1 * h1));
    const double pivot = 2 * (1 / h0 + 1 / h1) - factor[k - 1] / h0;
    factor[k] = 1 / (h1 * pivot);
    slope[k] = (right - slope[k - 1] / h0) / pivot;
  }
  for (std::size_t k = n - 1; k-- > 1;) slope[k] -= factor[k] * slope[k + 1];
  return slope;
}

}  // namespace redysim
