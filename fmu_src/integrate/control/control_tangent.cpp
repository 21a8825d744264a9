#include "integrate/control/control_tangent.hpp"

#include <algorithm>

#include "dynamics/aba.hpp"
#include "dynamics/input_layout.hpp"
#include "dynamics/rnea.hpp"

namespace redysim {

struct ControlTangent::Twin {
  Plan<Dual> plan;
  Workspace<Dual> workspace;
  std::vector<Dual> inputs, zero, qdd, tau;

  explicit Twin(const Model& model)
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
  if (law_ != Law::none && law_ != Law::pd) twin_ = std::make_unique<Twin>(model);
}

ControlTangent::~ControlTangent() = default;

void ControlTangent::go_to(const Model& model, System& system, double time) {
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const ControlledJoint& given = model.controller.joints[k];
    gains_[k] = {Dual(given.kp), Dual(given.kd), Dual(given.target)};
    const JointMotion motion = system.reference(joints_[k], time);
    references_[k] = {Dual(motion.q), Dual(motion.qd), Dual(motion.qdd)};
  }
  if (twin_) twin_->plan.update(model);
}

std::size_t ControlTangent::place(int joint) const {
  return static_cast<std::size_t>(std::find(joints_.begin(), joints_.end(), joint) - joints_.begin());
}

ControlTangent::Gains* ControlTangent::gains(int joint) {
  const std::size_t k = place(joint);
  return k < joints_.size() ? &gains_[k] : nullptr;
}

Plan<Dual>* ControlTangent::plan() { return twin_ ? &twin_->plan : nullptr; }

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
  const std::vector<Dual> model = twin_ ? model_forces(q, qd, force) : std::vector<Dual>();
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const int i = joints_[k];
    Dual law = twin_ ? model[i] : Dual(0);
    const Reference wanted = reference(k);
    if (law_ != Law::computed_torque)
      law += gains_[k].kp * (wanted.q - q[i]) + gains_[k].kd * (wanted.qd - qd[i]);
    force[i].derivative += law.derivative;
  }
}

// What the controller's own model adds, of all joints.
std::vector<Dual> ControlTangent::model_forces(const std::vector<Dual>& q, const std::vector<Dual>& qd,
                                               const std::vector<Dual>& force) {
  Twin& twin = *twin_;
  const std::size_t n = q.size();
  if (law_ == Law::feed_forward) {
    std::vector<Dual> along_q = q, along_qd = qd, along_qdd(force.begin(), force.begin() + n);
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const Reference wanted = reference(k);
      along_q[joints_[k]] = wanted.q;
      along_qd[joints_[k]] = wanted.qd;
      along_qdd[joints_[k]] = wanted.qdd;
    }
    inverse_dynamics(twin.plan, twin.workspace, along_q.data(), along_qd.data(), along_qdd.data(),
                     twin.tau.data());
    return twin.tau;
  }
  if (law_ == Law::gravity_compensation && twin.plan.loops.empty()) {
    inverse_dynamics(twin.plan, twin.workspace, q.data(), twin.zero.data(), twin.zero.data(),
                     twin.tau.data());
    return twin.tau;
  }
  std::fill(twin.inputs.begin(), twin.inputs.end(), Dual(0));
  if (law_ == Law::computed_torque) {
    std::copy_n(force.begin(), n, twin.inputs.begin());
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const Reference wanted = reference(k);
      const int i = joints_[k];
      twin.inputs[i] = wanted.qdd + gains_[k].kd * (wanted.qd - qd[i]) + gains_[k].kp * (wanted.q - q[i]);
    }
  }
  const Dual* speed = law_ == Law::computed_torque ? qd.data() : twin.zero.data();
  forward_dynamics(twin.plan, twin.workspace, q.data(), speed, twin.inputs.data(), twin.qdd.data());
  for (int i : joints_)
    twin.tau[i] = prescribed_force(twin.plan, twin.workspace, i, q.data(), speed, twin.inputs.data());
  return twin.tau;
}

}  // namespace redysim
