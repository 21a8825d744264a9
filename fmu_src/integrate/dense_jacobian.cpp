#include "integrate/dense_jacobian.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace redysim {

Status dense_jacobian(System& system, double time, const double* y, const double* slope, double* jacobian,
                      std::vector<double>& room, long& evaluations) {
  const int n = system.size();
  const int arguments = system.nq() + system.nv();
  const double root = std::sqrt(std::numeric_limits<double>::epsilon());
  std::copy_n(y, n, room.begin());
  for (int j = 0; j < arguments; ++j) {
    double* column = jacobian + static_cast<std::ptrdiff_t>(j) * n;
    // an increment that the sum represents exactly
    room[j] = y[j] + root * std::max(1.0, std::fabs(y[j]));
    const double increment = room[j] - y[j];
    ++evaluations;
    const Status status = system.right_hand_side(time, room.data(), column);
    if (status != Status::ok) return status;
    for (int i = 0; i < n; ++i) column[i] = (column[i] - slope[i]) / increment;
    room[j] = y[j];
  }
  std::fill(jacobian + static_cast<std::ptrdiff_t>(arguments) * n,
            jacobian + static_cast<std::ptrdiff_t>(n) * n, 0.0);
  return Status::ok;
}

}  // namespace redysim
