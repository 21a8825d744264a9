#include "integrate/control/control_tangent.hpp"

#include <algorithm>

#include "dynamics/aba.hpp"
#include "dynamics/input_layout.hpp"
#include "dynamics/rnea.hpp"

namespace redysim {

struct ControlTangent::InternalModel {
  Plan<Dual> plan;
  Workspace<Dual> workspace;
  std::vector<Dual> inputs, zero, qdd, tau;

  explicit InternalModel(const Model& model)
      : plan(with_controlled_motions(model)),
        workspace(plan),
        inputs(static_cast<std::size_t>(InputLayout(plan).recursion_size())),
        zero(static_cast<std::size_t>(plan.nv)),
        qdd(zero),
        tau(zero) {}
};

ControlTangent::ControlTangent(const Model& model, const Control& control)
    : law_(control.law()), joints_(control.joints()), gains_(joints_.size()), references_(joints_.size()) {
  for (int joint : joints_) follows_.push_back(control.follows(joint));
  for (int joint = 0; joint < control.joint_count(); ++joint)
    if (control.prescribes(joint)) on_trajectories_.push_back(joint);
  if (law_ != Law::none && law_ != Law::pd) internal_model_ = std::make_unique<InternalModel>(model);
}

ControlTangent::~ControlTangent() = default;

void ControlTangent::go_to(const Model& model, System& system, double time) {
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const ControlledJoint& given = model.controller.joints[k];
    gains_[k] = {Dual(given.kp), Dual(given.kd), Dual(given.target)};
    const JointMotion motion = system.reference(joints_[k], time);
    references_[k] = {Dual(motion.q), Dual(motion.qd), Dual(motion.qdd)};
  }
  if (internal_model_) internal_model_->plan.update(model);
}

std::size_t ControlTangent::place(int joint) const {
  return static_cast<std::size_t>(std::find(joints_.begin(), joints_.end(), joint) - joints_.begin());
}

ControlTangent::Gains* ControlTangent::gains(int joint) {
  const std::size_t k = place(joint);
  return k < joints_.size() ? &gains_[k] : nullptr;
}

Plan<Dual>* ControlTangent::plan() { return internal_model_ ? &internal_model_->plan : nullptr; }

ControlTangent::Reference ControlTangent::reference(std::size_t k) const {
  Reference wanted = references_[k];
  if (!follows_[k]) wanted.q = gains_[k].target;
  return wanted;
}

Dual ControlTangent::reference_q(int joint) const { return reference(place(joint)).q; }
Dual ControlTangent::reference_qd(int joint) const { return reference(place(joint)).qd; }

void ControlTangent::go_with_time(System& system, double time, std::vector<Dual>& force) {
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
  const std::vector<Dual> model = internal_model_ ? model_forces(q, qd, force) : std::vector<Dual>();
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const int i = joints_[k];
    Dual law = internal_model_ ? model[i] : Dual(0);
    const Reference wanted = reference(k);
    if (law_ != Law::computed_torque)
      law += gains_[k].kp * (wanted.q - q[i]) + gains_[k].kd * (wanted.qd - qd[i]);
    force[i].derivative += law.derivative;
  }
}

// The torques from the controller's own model, of all joints.
std::vector<Dual> ControlTangent::model_forces(const std::vector<Dual>& q, const std::vector<Dual>& qd,
                                               const std::vector<Dual>& force) {
  InternalModel& internal = *internal_model_;
  const std::size_t n = q.size();
  if (law_ == Law::feed_forward) {
    std::vector<Dual> along_q = q, along_qd = qd, along_qdd(force.begin(), force.begin() + n);
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const Reference wanted = reference(k);
      along_q[joints_[k]] = wanted.q;
      along_qd[joints_[k]] = wanted.qd;
      along_qdd[joints_[k]] = wanted.qdd;
    }
    inverse_dynamics(internal.plan, internal.workspace, along_q.data(), along_qd.data(), along_qdd.data(),
                     internal.tau.data());
    return internal.tau;
  }
  if (law_ == Law::gravity_compensation && internal.plan.loops.empty()) {
    inverse_dynamics(internal.plan, internal.workspace, q.data(), internal.zero.data(), internal.zero.data(),
                     internal.tau.data());
    return internal.tau;
  }
  std::fill(internal.inputs.begin(), internal.inputs.end(), Dual(0));
  if (law_ == Law::computed_torque) {
    std::copy_n(force.begin(), n, internal.inputs.begin());
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const Reference wanted = reference(k);
      const int i = joints_[k];
      internal.inputs[i] = wanted.qdd + gains_[k].kd * (wanted.qd - qd[i]) + gains_[k].kp * (wanted.q - q[i]);
    }
  }
  const Dual* speed = law_ == Law::computed_torque ? qd.data() : internal.zero.data();
  forward_dynamics(internal.plan, internal.workspace, q.data(), speed, internal.inputs.data(),
                   internal.qdd.data());
  for (int i : joints_)
    internal.tau[i] =
        prescribed_force(internal.plan, internal.workspace, i, q.data(), speed, internal.inputs.data());
  return internal.tau;
}

}  // namespace redysim
