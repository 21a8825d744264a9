#include "integrate/system/control_tangent.hpp"

#include <algorithm>

#include "integrate/control/internal_model.hpp"

namespace redysim {

ControlTangent::ControlTangent(const Control& control)
    : law_(control.law()), joints_(control.joints()), gains_(joints_.size()), references_(joints_.size()) {
  for (int joint : joints_) follows_.push_back(control.follows(joint));
  for (int joint = 0; joint < control.joint_count(); ++joint)
    if (control.prescribes(joint)) on_trajectories_.push_back(joint);
  if (const Plan<double>* plan = control.internal_plan())
    internal_model_ = std::make_unique<InternalModel<Dual>>(law_, Plan<Dual>(*plan));
}

ControlTangent::~ControlTangent() = default;

void ControlTangent::go_to(System& system, double time) {
  holds_ = system.controller_holds();
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const JointMotion motion = system.reference(joints_[k], time);
    references_[k] = {Dual(motion.q), Dual(motion.qd), Dual(motion.qdd)};
  }
}

void ControlTangent::update(const Parameters<Dual>& parameters) {
  gains_ = parameters.controlled;
  if (internal_model_) internal_model_->update(parameters);
}

ControlTangent::Reference ControlTangent::wanted(std::size_t k) const {
  Reference reference = references_[k];
  if (!follows_[k]) reference.q = gains_[k].target;
  return reference;
}

ControlTangent::Reference ControlTangent::reference(int joint) const {
  return wanted(static_cast<std::size_t>(std::find(joints_.begin(), joints_.end(), joint) - joints_.begin()));
}

void ControlTangent::go_with_time(System& system, double time, std::vector<Dual>& force) {
  holds_ = system.control()->is_sampled();
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    if (!follows_[k]) continue;
    Reference& wanted = references_[k];
    wanted.q.derivative = wanted.qd.value;
    wanted.qd.derivative = wanted.qdd.value;
    wanted.qdd.derivative = system.jerk(joints_[k], time);
  }
  for (int joint : on_trajectories_) force[joint].derivative = system.jerk(joint, time);
}

void ControlTangent::answer(const std::vector<Dual>& q, const std::vector<Dual>& qd,
                            std::vector<Dual>& force) {
  if (holds_) return;
  if (internal_model_) {
    const auto of = [this](std::size_t k) { return wanted(k); };
    internal_model_->evaluate(joints_, of, gains_, q.data(), qd.data(), force.data(),
                              internal_model_->torques.data());
  }
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const int i = joints_[k];
    Dual law = internal_model_ ? internal_model_->torques[i] : Dual(0);
    const Reference reference = wanted(k);
    if (law_ != Law::computed_torque)
      law += gains_[k].kp * (reference.q - q[i]) + gains_[k].kd * (reference.qd - qd[i]);
    force[i].derivative += law.derivative;
  }
}

}  // namespace redysim
