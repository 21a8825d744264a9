#include "integrate/system/stiffest_joint.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
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
  // velocity that belongs to a position.
  double rate(int component, int of) {
    const double size = derivative(component, of);
    return component == of ? size : std::sqrt(size);
  }
  // Frequency, rad/s, of an oscillation between two components, for example a current and a speed.
  double exchange(int one, int other) {
    return std::sqrt(derivative(one, other)) * std::sqrt(derivative(other, one));
  }

 private:
  // |d slope[of] / d component|; 0: not finite.
  double derivative(int component, int of) {
    const double value = at_[component];
    system_.difference_steps(at_.data(), moved_.data());
    const double step = moved_[component];
    at_[component] = value + step;
    const bool ok = system_.slope_within_step(time_, at_.data(), moved_.data()) == Status::ok;
    at_[component] = value;
    return ok ? std::fabs(moved_[of] - slope_[of]) / step : 0;
  }

  System& system_;
  double time_;
  std::vector<double> at_, slope_, moved_;
};

// Place of the velocity of a joint in the state, -1: none.
int velocity_of(const System& system, int joint) {
  for (int k = 0; k < system.simple(); ++k)
    if (system.joint_of(k) == joint) return system.layout().qd[k];
  return -1;
}

// Largest rate of the states of actuator k, 1/s.
double rate_of(const System& system, RateProbe& probe, const Actuators& actuators, int k) {
  const auto [motor_q, motor_qd, current, lagged] = actuators.places(k);
  double fastest = 0;
  for (const auto& [component, of] : {std::pair(motor_q, motor_qd), std::pair(motor_qd, motor_qd),
                                      std::pair(current, current), std::pair(lagged, lagged)})
    if (component >= 0) fastest = std::max(fastest, probe.rate(component, of));
  const int speed = motor_qd >= 0 ? motor_qd : velocity_of(system, actuators.joint(k));
  if (current >= 0 && speed >= 0) fastest = std::max(fastest, probe.exchange(current, speed));
  return fastest;
}

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
  for (int k = 0; actuators && k < actuators->size(); ++k)
    if (const double rate = rate_of(system, probe, *actuators, k); rate > fastest)
      fastest = rate, driven = actuators->joint(k);
  if (driven >= 0)
    system.set_failed_drive(driven);
  else if (stiffest >= 0)
    system.set_failed_joint(stiffest);
  return fastest;
}

}  // namespace redysim
