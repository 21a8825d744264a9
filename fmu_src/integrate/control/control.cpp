#include "integrate/control/control.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/compiled.hpp"
#include "dynamics/input_layout.hpp"
#include "dynamics/joint_elimination.hpp"

namespace redysim {

// The plant with its controlled joints prescribed: what their drives must give for given accelerations, while
// loops, free joints and other drives do what they do.
struct Control::Twin {
  Plan<double> plan;
  Workspace<double> workspace;
  std::vector<double> inputs, q, qd, qdd, tau, zero;
  std::vector<double> held, moved;  // of differences: torques at the point, inputs beside it

  explicit Twin(const Model& model)
      : plan(with_controlled_motions(model)),
        workspace(plan),
        inputs(static_cast<std::size_t>(InputLayout(plan).recursion_size()), 0.0),
        q(static_cast<std::size_t>(plan.nv), 0.0),
        qd(q),
        qdd(q),
        tau(q),
        zero(q),
        held(q),
        moved(q) {}
};

Model with_controlled_motions(Model model) {
  for (const ControlledJoint& joint : model.controller.joints)
    model.links[joint.link].joint.drive = Drive::motion;
  return model;
}

Control::Control(const Model& model, const Plan<double>& plan)
    : law_(model.controller.law),
      trajectories_(model.trajectories),
      trajectory_of_(static_cast<std::size_t>(plan.nv), -1),
      prescribed_(trajectory_of_.size(), 0),
      gains_(model.controller.joints) {
  for (int i = 0; i < plan.nv; ++i) prescribed_[i] = plan.joints[i].prescribed;
  for (std::size_t k = 0; k < trajectories_.size(); ++k)
    trajectory_of_[plan.carrier[trajectories_[k].link]] = static_cast<int>(k);
  for (const ControlledJoint& joint : gains_) joints_.push_back(plan.carrier[joint.link]);
  if (law_ != Law::none && law_ != Law::pd) twin_ = std::make_unique<Twin>(model);
}

Control::~Control() = default;

void Control::update(const Model& model) {
  gains_ = model.controller.joints;
  if (twin_) twin_->plan.update(model);
}

bool Control::enter(double time, double* phases) const {
  // a border that rounding alone keeps ahead is passed: the pieces meet there
  const double slack = 1e-12 * std::max(1.0, std::abs(time));
  bool changed = false;
  for (std::size_t k = 0; k < trajectories_.size(); ++k) {
    const auto phase = static_cast<double>(phase_at(trajectories_[k], time + slack));
    changed = changed || phase != phases[k];
    phases[k] = phase;
  }
  return changed;
}

// At the points of a table the acceleration has kinks, which an error estimate may not see.
double Control::next_border(double time, const double* phases) const {
  const double passed = time + 1e-12 * std::max(1.0, std::abs(time));
  double next = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < trajectories_.size(); ++k) {
    const Phase phase = static_cast<Phase>(static_cast<int>(phases[k]));
    next = std::min(next, end_of(trajectories_[k], phase));
    if (phase == Phase::inside) next = std::min(next, next_knot(trajectories_[k], passed));
  }
  return next;
}

bool Control::controls(int joint) const {
  return std::find(joints_.begin(), joints_.end(), joint) != joints_.end();
}

void Control::set_motions(double time, const double* phases, double* q, double* qd) const {
  for (std::size_t i = 0; i < trajectory_of_.size(); ++i) {
    if (!prescribes(static_cast<int>(i))) continue;
    const int k = trajectory_of_[i];
    const JointMotion motion =
        motion_at(trajectories_[k], static_cast<Phase>(static_cast<int>(phases[k])), time);
    q[i] = motion.q;
    qd[i] = motion.qd;
  }
}

JointMotion Control::reference(int joint, double time, const double* phases) const {
  const int k = trajectory_of_[joint];
  if (k >= 0) return motion_at(trajectories_[k], static_cast<Phase>(static_cast<int>(phases[k])), time);
  const auto place = std::find(joints_.begin(), joints_.end(), joint) - joints_.begin();
  return {gains_[static_cast<std::size_t>(place)].target, 0, 0};
}

double Control::jerk(int joint, double time, const double* phases) const {
  const int k = trajectory_of_[joint];
  return k < 0 ? 0 : jerk_at(trajectories_[k], static_cast<Phase>(static_cast<int>(phases[k])), time);
}

void Control::apply(double time, const double* phases, const double* q, const double* qd, double* inputs) {
  for (std::size_t i = 0; i < trajectory_of_.size(); ++i)
    if (prescribes(static_cast<int>(i))) {
      const int k = trajectory_of_[i];
      inputs[i] = motion_at(trajectories_[k], static_cast<Phase>(static_cast<int>(phases[k])), time).qdd;
    }
  if (twin_) model_torques(time, phases, q, qd, inputs, twin_->tau.data());
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const int i = joints_[k];
    if (twin_) inputs[i] += twin_->tau[i];
    if (law_ == Law::computed_torque) continue;
    const JointMotion wanted = reference(i, time, phases);
    inputs[i] += gains_[k].kp * (wanted.q - q[i]) + gains_[k].kd * (wanted.qd - qd[i]);
  }
}

// What the laws add to PD, or in place of it, into tau of the controlled joints.
void Control::model_torques(double time, const double* phases, const double* q, const double* qd,
                            const double* inputs, double* tau) {
  Twin& twin = *twin_;
  if (law_ == Law::computed_torque) return computed_torque(time, phases, q, qd, inputs, tau);
  if (law_ == Law::gravity_compensation) {
    if (twin.plan.loops.empty()) {
      compiled_inverse_dynamics(twin.plan, twin.workspace, q, twin.zero.data(), twin.zero.data(), tau);
      return;
    }
    // what keeps the controlled joints at rest, with the loops' help
    std::fill(twin.inputs.begin(), twin.inputs.end(), 0.0);
    compiled_forward_dynamics(twin.plan, twin.workspace, q, twin.zero.data(), twin.inputs.data(),
                              twin.qdd.data());
    for (int i : joints_)
      tau[i] = prescribed_force(twin.plan, twin.workspace, i, q, twin.zero.data(), twin.zero.data());
    return;
  }
  // feed-forward: all joints are controlled or prescribed
  std::copy_n(q, twin.q.size(), twin.q.begin());
  std::copy_n(qd, twin.q.size(), twin.qd.begin());
  std::copy_n(inputs, twin.q.size(), twin.qdd.begin());
  for (int i : joints_) {
    const JointMotion wanted = reference(i, time, phases);
    twin.q[i] = wanted.q;
    twin.qd[i] = wanted.qd;
    twin.qdd[i] = wanted.qdd;
  }
  compiled_inverse_dynamics(twin.plan, twin.workspace, twin.q.data(), twin.qd.data(), twin.qdd.data(), tau);
}

// The torques at which qdd = qdd_reference + kd e' + kp e. It knows the other joints' drives, not the forces
// at ports.
void Control::computed_torque(double time, const double* phases, const double* q, const double* qd,
                              const double* inputs, double* tau) {
  Twin& twin = *twin_;
  std::copy_n(inputs, twin.q.size(), twin.inputs.begin());
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const int i = joints_[k];
    const JointMotion wanted = reference(i, time, phases);
    twin.inputs[i] = wanted.qdd + gains_[k].kd * (wanted.qd - qd[i]) + gains_[k].kp * (wanted.q - q[i]);
  }
  compiled_forward_dynamics(twin.plan, twin.workspace, q, qd, twin.inputs.data(), twin.qdd.data());
  for (int i : joints_) tau[i] = prescribed_force(twin.plan, twin.workspace, i, q, qd, twin.inputs.data());
}

void Control::close(double time, const double* phases, const double* q, const double* qd,
                    const double* inputs, const std::vector<int>& variables, double* columns) {
  const int n = static_cast<int>(trajectory_of_.size());
  const std::size_t length = static_cast<std::size_t>(n) + 1, count = variables.size() - joints_.size();
  const double* by_force = columns + count * length;
  const auto add = [&](std::size_t variable, std::size_t k, double factor) {
    for (std::size_t row = 0; row < length; ++row)
      columns[variable * length + row] += factor * by_force[k * length + row];
  };
  if (law_ != Law::computed_torque)
    for (std::size_t v = 0; v < count; ++v)
      for (std::size_t k = 0; k < joints_.size(); ++k)
        if (variables[v] % n == joints_[k] && variables[v] / n < 2)
          add(v, k, variables[v] / n == 0 ? -gains_[k].kp : -gains_[k].kd);
  if (!twin_ || law_ == Law::feed_forward) return;  // the reference does not follow the state

  // forward differences of the model's part
  Twin& twin = *twin_;
  constexpr double step = 1.5e-8;  // square root of rounding
  std::copy_n(q, n, twin.q.begin());
  std::copy_n(qd, n, twin.qd.begin());
  std::copy_n(inputs, n, twin.moved.begin());
  model_torques(time, phases, q, qd, inputs, twin.held.data());
  for (std::size_t v = 0; v < count; ++v) {
    const int kind = variables[v] / n, joint = variables[v] % n;
    double& value = (kind == 0 ? twin.q : kind == 1 ? twin.qd : twin.moved)[joint];
    const double at = value, h = step * std::max(1.0, std::abs(at));
    value = at + h;
    model_torques(time, phases, twin.q.data(), twin.qd.data(), twin.moved.data(), twin.tau.data());
    value = at;
    for (std::size_t k = 0; k < joints_.size(); ++k)
      add(v, k, (twin.tau[joints_[k]] - twin.held[joints_[k]]) / h);
  }
}

}  // namespace redysim
