#include "integrate/system/stiffest_joint.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace redysim {

double find_stiffest_joint(System& system, double time, const double* y) {
  constexpr double difference = 1e-8;
  const StateLayout& layout = system.layout();
  std::vector<double> at(y, y + system.size()), slope(at.size()), moved(at.size());
  if (system.right_hand_side(time, y, slope.data()) != Status::ok) return 0;
  double fastest = 0;
  int stiffest = -1;
  for (int k = 0; k < system.nv(); ++k) {
    // quaternions are not counted
    const int velocity = layout.qd.begin + k;
    for (int component : {k < layout.q.count ? layout.q[k] : velocity, velocity}) {
      const double step = difference * std::max(1.0, std::fabs(y[component]));
      at[component] = y[component] + step;
      if (system.right_hand_side(time, at.data(), moved.data()) == Status::ok) {
        const double change = std::fabs(moved[velocity] - slope[velocity]) / step;
        const double rate = component == velocity ? change : std::sqrt(change);
        if (rate > fastest) fastest = rate, stiffest = k;
      }
      at[component] = y[component];
    }
  }
  if (stiffest >= 0) system.set_failed_joint(stiffest);
  return fastest;
}

}  // namespace redysim
