#include "integrate/methods/error_weights.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/motion_subspace.hpp"
#include "math/angles.hpp"

namespace redysim {

ErrorWeights::ErrorWeights(const System& system, double rtol, double atol)
    : system_(system), rtol_(rtol), atol_(atol) {
  constexpr double turn = 2 * pi;
  const auto& work = system.layout().work;
  cap_.assign(static_cast<std::size_t>(work.begin), std::numeric_limits<double>::max());
  // the state does not show the forces of prescribed joints and of laws that cancel forces
  const Control* control = system.control();
  const bool computes = control && control->internal_plan() && !control->is_sampled();
  weighted_ = system.has_prescribed_joints() || computes ? work.end() : work.begin;
  for (int i = 0; i < system.simple(); ++i)
    if (turns(system.plan().joints[system.joint_of(i)])) cap_[i] = turn;
  // the limit is a full turn of the joint, on the side of the motor
  const Actuators* actuators = system.actuators();
  for (int k = 0; actuators && k < actuators->size(); ++k) {
    const int place = actuators->places(k).motor_q;
    if (place >= 0 && turns(system.plan().joints[actuators->joint(k)]))
      cap_[place] = turn * std::fabs(actuators->law(k).gear_ratio);
  }
}

void ErrorWeights::evaluate(const double* y, double* weights, double share) const {
  const double rtol = share * rtol_, atol = share * atol_;
  const auto weight = [&](int i, double scale, double other) {
    const double size = std::fabs(y[i]);
    const double tolerance = rtol * std::min(size, cap_[i]) + atol * scale;
    const double at_zero = 1e-6 * scale;  // for a state that starts at zero with atol = 0
    weights[i] = 1.0 / std::max(tolerance, finest * std::max(std::max(size, other), at_zero));
  };
  const StateLayout& layout = system_.layout();
  for (int k = 0; k < layout.q.count; ++k) {
    const double scale = system_.scales()[k];
    weight(layout.q[k], scale, 0);
    weight(layout.qd[k], scale, std::fabs(y[layout.q[k]]));
  }
  for (int i = layout.quaternion.begin; i < layout.quaternion.end(); ++i) weight(i, 1, 0);
  for (int i = layout.omega.begin; i < layout.omega.end(); ++i) weight(i, 1, 0);
  if (layout.actuators() > 0) {
    const double* scales = &system_.scales()[static_cast<std::size_t>(layout.q.count)];
    for (int i = 0; i < layout.actuators(); ++i) weight(layout.motor_q.begin + i, scales[i], 0);
    for (int k = 0; k < layout.motor_q.count; ++k)
      weight(layout.motor_qd[k], scales[layout.motor_q.count + k], std::fabs(y[layout.motor_q[k]]));
  }
  for (int i = layout.work.begin; i < layout.work.end(); ++i) weights[i] = 0;
}

void ErrorWeights::weigh_work(System& system, double time, const double* y, double* weights) const {
  const int begin = system_.layout().work.begin;
  if (weighted_ == begin) return;
  const double energy = system.energy_scale(time, y);
  for (int i = begin; i < weighted_; ++i) {
    const double tolerance = rtol_ * (std::fabs(y[i]) + energy);
    weights[i] = tolerance > 0 ? 1 / tolerance : 0;
  }
}

double ErrorWeights::norm(const double* error, const double* weights) const {
  double sum = 0;
  for (int i = 0; i < weighted_; ++i) sum += error[i] * weights[i] * error[i] * weights[i];
  return std::sqrt(sum / std::max(1.0, static_cast<double>(cap_.size())));
}

}  // namespace redysim
