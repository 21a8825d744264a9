#include <algorithm>

#include "integrate/control/control.hpp"
#include "integrate/control/internal_model.hpp"

// The functions of Control that every right-hand side calls.

namespace redysim {

JointMotion Control::reference(int joint, double time, const double* phases) const {
  const int k = trajectory_of_[joint];
  if (k >= 0) return motion_at(trajectories_[k], static_cast<int>(phases[k]), time);
  const auto place = std::find(joints_.begin(), joints_.end(), joint) - joints_.begin();
  return {gains_[static_cast<std::size_t>(place)].target, 0, 0};
}

void Control::set_accelerations(double time, const double* phases, double* inputs) const {
  for (std::size_t i = 0; i < trajectory_of_.size(); ++i)
    if (prescribes(static_cast<int>(i))) {
      const int k = trajectory_of_[i];
      inputs[i] = motion_at(trajectories_[k], static_cast<int>(phases[k]), time).qdd;
    }
}

void Control::apply(double time, const double* phases, const double* q, const double* qd, double* inputs) {
  set_accelerations(time, phases, inputs);
  if (!holds(phases)) {
    add_law(time, phases, q, qd, inputs);
    return;
  }
  const double* held = sampler_.held(phases + trajectories_.size());
  for (std::size_t k = 0; k < joints_.size(); ++k) inputs[joints_[k]] += held[k];
}

bool Control::enter_samples(double time, double* phases, const double* q, const double* qd, double* inputs) {
  double* memory = phases + trajectories_.size();
  if (sampler_.is_due(time, memory)) {
    set_accelerations(time, phases, inputs);
    for (int joint : joints_) inputs[joint] = 0;
    add_law(time, phases, q, qd, inputs);
    for (std::size_t k = 0; k < joints_.size(); ++k) sampled_[k] = inputs[joints_[k]];
    sampler_.sample(time, sampled_.data(), memory);
  }
  return sampler_.arrive(time, memory);
}

void Control::add_law(double time, const double* phases, const double* q, const double* qd, double* inputs) {
  if (internal_model_) model_torques(time, phases, q, qd, inputs, internal_model_->torques.data());
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const int i = joints_[k];
    if (internal_model_) inputs[i] += internal_model_->torques[i];
    if (law_ == Law::computed_torque) continue;
    const JointMotion wanted = reference(i, time, phases);
    inputs[i] += gains_[k].kp * (wanted.q - q[i]) + gains_[k].kd * (wanted.qd - qd[i]);
  }
}

void Control::model_torques(double time, const double* phases, const double* q, const double* qd,
                            const double* inputs, double* torques) {
  const auto wanted = [&](std::size_t k) { return reference(joints_[k], time, phases); };
  internal_model_->evaluate(joints_, wanted, gains_, q, qd, inputs, torques);
}

}  // namespace redysim
