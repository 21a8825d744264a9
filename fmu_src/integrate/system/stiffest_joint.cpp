#include "integrate/system/stiffest_joint.hpp"

#include <cmath>
#include <vector>

namespace redysim {
namespace {

// Rates of single components at one point.
class RateProbe {
 public:
  RateProbe(System& system, double time, const double* y)
      : system_(system), time_(time), at_(y, y + system.size()), slope_(at_.size()), moved_(at_.size()) {}

  bool start() { return system_.slope_within_step(time_, at_.data(), slope_.data()) == Status::ok; }
  // Rate, 1/s, from the derivative of the slope of `of` by `component`: `of` is the component itself, or the
  // velocity that belongs to a position. 0: not finite.
  double rate(int component, int of) {
    const double value = at_[component];
    system_.difference_steps(at_.data(), moved_.data());
    const double step = moved_[component];
    at_[component] = value + step;
    const bool ok = system_.slope_within_step(time_, at_.data(), moved_.data()) == Status::ok;
    at_[component] = value;
    const double change = ok ? std::fabs(moved_[of] - slope_[of]) / step : 0;
    return component == of ? change : std::sqrt(change);
  }

 private:
  System& system_;
  double time_;
  std::vector<double> at_, slope_, moved_;
};

}  // namespace

double find_stiffest_joint(System& system, double time, const double* y) {
  const StateLayout& layout = system.layout();
  RateProbe probe(system, time, y);
  if (!probe.start()) return 0;
  double fastest = 0;
  int stiffest = -1, driven = -1;  // index of a velocity; index of a joint whose actuator is faster
  for (int k = 0; k < system.nv(); ++k) {
    // quaternions are not considered
    const int velocity = layout.qd.begin + k;
    for (int component : {k < layout.q.count ? layout.q[k] : velocity, velocity})
      if (const double rate = probe.rate(component, velocity); rate > fastest) fastest = rate, stiffest = k;
  }
  const Actuators* actuators = system.actuators();
  for (int k = 0; actuators && k < actuators->size(); ++k) {
    const auto [motor_q, motor_qd, current, lagged] = actuators->places(k);
    for (const auto& [component, of] : {std::pair(motor_q, motor_qd), std::pair(motor_qd, motor_qd),
                                        std::pair(current, current), std::pair(lagged, lagged)})
      if (const double rate = component < 0 ? 0 : probe.rate(component, of); rate > fastest)
        fastest = rate, driven = actuators->joint(k);
  }
  if (driven >= 0)
    system.set_failed_drive(driven);
  else if (stiffest >= 0)
    system.set_failed_joint(stiffest);
  return fastest;
}

}  // namespace redysim
