#include "integrate/control/control.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/compiled.hpp"
#include "dynamics/input_layout.hpp"
#include "dynamics/joint_elimination.hpp"

namespace redysim {

// The plant with its controlled joints prescribed: gives the torques of their drives for given accelerations.
struct Control::InternalModel {
  Plan<double> plan;
  Workspace<double> workspace;
  std::vector<double> inputs, q, qd, qdd, tau, zero;
  std::vector<double> held, moved;  // for differences: torques at the point, changed inputs

  explicit InternalModel(const Model& model)
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

  double& moved_value(JointVariable variable) {
    using Kind = JointVariable::Kind;
    return (variable.kind == Kind::position   ? q
            : variable.kind == Kind::velocity ? qd
                                              : moved)[variable.joint];
  }
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
  if (law_ != Law::none && law_ != Law::pd) internal_model_ = std::make_unique<InternalModel>(model);
}

Control::~Control() = default;

void Control::update(const Model& model) {
  gains_ = model.controller.joints;
  if (internal_model_) internal_model_->plan.update(model);
}

bool Control::enter(double time, double* phases) const {
  // a breakpoint that is ahead by rounding only counts as passed: the pieces are continuous there
  const double slack = 1e-12 * std::max(1.0, std::abs(time));
  bool changed = false;
  for (std::size_t k = 0; k < trajectories_.size(); ++k) {
    const auto phase = static_cast<double>(phase_at(trajectories_[k], time + slack));
    changed = changed || phase != phases[k];
    phases[k] = phase;
  }
  return changed;
}

// At the points of a table the slope of the acceleration jumps, which an error estimate may miss.
double Control::next_breakpoint(double time, const double* phases) const {
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
  if (internal_model_) model_torques(time, phases, q, qd, inputs, internal_model_->tau.data());
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const int i = joints_[k];
    if (internal_model_) inputs[i] += internal_model_->tau[i];
    if (law_ == Law::computed_torque) continue;
    const JointMotion wanted = reference(i, time, phases);
    inputs[i] += gains_[k].kp * (wanted.q - q[i]) + gains_[k].kd * (wanted.qd - qd[i]);
  }
}

// What the laws add to PD, or use instead of it, into `torques` of the controlled joints.
void Control::model_torques(double time, const double* phases, const double* q, const double* qd,
                            const double* inputs, double* torques) {
  if (law_ == Law::computed_torque)
    computed_torque(time, phases, q, qd, inputs, torques);
  else if (law_ == Law::gravity_compensation)
    gravity_compensation(q, torques);
  else
    feed_forward(time, phases, q, qd, inputs, torques);
}

// The torques that keep the controlled joints at rest.
void Control::gravity_compensation(const double* q, double* torques) {
  InternalModel& model = *internal_model_;
  const double* zero = model.zero.data();
  if (model.plan.loops.empty()) {
    compiled_inverse_dynamics(model.plan, model.workspace, q, zero, zero, torques);
    return;
  }
  std::fill(model.inputs.begin(), model.inputs.end(), 0.0);
  compiled_forward_dynamics(model.plan, model.workspace, q, zero, model.inputs.data(), model.qdd.data());
  for (int i : joints_) torques[i] = prescribed_force(model.plan, model.workspace, i, q, zero, zero);
}

// The torques along the reference. All joints are controlled or prescribed.
void Control::feed_forward(double time, const double* phases, const double* q, const double* qd,
                           const double* inputs, double* torques) {
  InternalModel& model = *internal_model_;
  std::copy_n(q, model.q.size(), model.q.begin());
  std::copy_n(qd, model.q.size(), model.qd.begin());
  std::copy_n(inputs, model.q.size(), model.qdd.begin());
  for (int i : joints_) {
    const JointMotion wanted = reference(i, time, phases);
    model.q[i] = wanted.q;
    model.qd[i] = wanted.qd;
    model.qdd[i] = wanted.qdd;
  }
  compiled_inverse_dynamics(model.plan, model.workspace, model.q.data(), model.qd.data(), model.qdd.data(),
                            torques);
}

// The torques at which qdd = qdd_reference + kd e' + kp e. The law knows the drives of the other joints, but
// not the forces at ports.
void Control::computed_torque(double time, const double* phases, const double* q, const double* qd,
                              const double* inputs, double* torques) {
  InternalModel& model = *internal_model_;
  std::copy_n(inputs, model.q.size(), model.inputs.begin());
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const int i = joints_[k];
    const JointMotion wanted = reference(i, time, phases);
    model.inputs[i] = wanted.qdd + gains_[k].kd * (wanted.qd - qd[i]) + gains_[k].kp * (wanted.q - q[i]);
  }
  compiled_forward_dynamics(model.plan, model.workspace, q, qd, model.inputs.data(), model.qdd.data());
  for (int i : joints_)
    torques[i] = prescribed_force(model.plan, model.workspace, i, q, qd, model.inputs.data());
}

void Control::add_feedback(double time, const double* phases, const double* q, const double* qd,
                           const double* inputs, const std::vector<JointVariable>& variables,
                           double* columns) {
  add_gains(variables, columns);
  // the reference of feed-forward does not depend on the state
  if (!internal_model_ || law_ == Law::feed_forward) return;

  // forward differences of the model's part
  InternalModel& model = *internal_model_;
  constexpr double step = 1.5e-8;  // square root of rounding
  const std::size_t n = trajectory_of_.size(), first_force = variables.size() - joints_.size();
  std::copy_n(q, n, model.q.begin());
  std::copy_n(qd, n, model.qd.begin());
  std::copy_n(inputs, n, model.moved.begin());
  model_torques(time, phases, q, qd, inputs, model.held.data());
  for (std::size_t v = 0; v < first_force; ++v) {
    double& value = model.moved_value(variables[v]);
    const double at = value, h = step * std::max(1.0, std::abs(at));
    value = at + h;
    model_torques(time, phases, model.q.data(), model.qd.data(), model.moved.data(), model.tau.data());
    value = at;
    for (std::size_t k = 0; k < joints_.size(); ++k)
      add_force_column(v, (model.tau[joints_[k]] - model.held[joints_[k]]) / h, first_force + k, columns);
  }
}

// d tau = -kp d q - kd d qd
void Control::add_gains(const std::vector<JointVariable>& variables, double* columns) const {
  if (law_ == Law::computed_torque) return;
  const std::size_t first_force = variables.size() - joints_.size();
  for (std::size_t v = 0; v < first_force; ++v)
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const auto [kind, joint] = variables[v];
      if (joint != joints_[k] || kind == JointVariable::Kind::force) continue;
      const double gain = kind == JointVariable::Kind::position ? gains_[k].kp : gains_[k].kd;
      add_force_column(v, -gain, first_force + k, columns);
    }
}

// Adds `factor` times the column of a force to that of a variable, nv + 1 apart each.
void Control::add_force_column(std::size_t variable, double factor, std::size_t force,
                               double* columns) const {
  const std::size_t length = trajectory_of_.size() + 1;
  for (std::size_t row = 0; row < length; ++row)
    columns[variable * length + row] += factor * columns[force * length + row];
}

}  // namespace redysim
