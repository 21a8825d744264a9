#include "integrate/control/control.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "integrate/control/internal_model.hpp"
#include "model/any_of.hpp"

namespace redysim {

namespace {

// Adds `factor` times the column of a force to the column of a variable.
void add_force_column(std::size_t variable, double factor, std::size_t force, double* columns,
                      std::size_t length) {
  for (std::size_t row = 0; row < length; ++row)
    columns[variable * length + row] += factor * columns[force * length + row];
}

}  // namespace

Model known_plant(Model model) {
  for (const ControlledJoint& joint : model.controller.joints)
    model.links[joint.link].joint.drive = Drive::motion;
  if (model.controller.law == Law::gravity_compensation) model.contacts.clear();
  return model;
}

Control::Control(const Model& model, const Plan<double>& plan)
    : law_(model.controller.law),
      trajectories_(model.trajectories),
      trajectory_of_(static_cast<std::size_t>(plan.nv), -1),
      prescribed_(trajectory_of_.size(), 0),
      gains_(model.controller.joints),
      sampler_(model.controller, model.starts_in_equilibrium),
      sampled_(gains_.size()) {
  for (int i = 0; i < plan.nv; ++i) prescribed_[i] = plan.joints[i].prescribed;
  for (std::size_t k = 0; k < trajectories_.size(); ++k)
    trajectory_of_[plan.carrier[trajectories_[k].link]] = static_cast<int>(k);
  for (const ControlledJoint& joint : gains_) joints_.push_back(plan.carrier[joint.link]);
  if (law_ == Law::none || law_ == Law::pd) return;
  internal_model_ = std::make_unique<InternalModel<double>>(law_, Plan<double>(known_plant(model)));
  for (std::vector<double>* values : {&changed_.q, &changed_.qd, &changed_.inputs, &changed_.torques})
    values->resize(trajectory_of_.size());
}

Control::~Control() = default;

const Plan<double>* Control::internal_plan() const {
  return internal_model_ ? &internal_model_->plan : nullptr;
}

void Control::update(const Parameters<double>& parameters) {
  gains_ = parameters.controlled;
  if (internal_model_) internal_model_->update(parameters);
}

bool Control::enter(double time, double* phases) const {
  bool changed = false;
  for (std::size_t k = 0; k < trajectories_.size(); ++k) {
    const double phase = phase_at(trajectories_[k], passed(time));  // a phase is continuous at its start
    changed = changed || phase != phases[k];
    phases[k] = phase;
  }
  return changed;
}

// At the knots of a table the derivative of the acceleration jumps, which an error estimate may miss.
StepLimits Control::step_limits(double time, const double* phases) const {
  StepLimits limits;
  for (std::size_t k = 0; k < trajectories_.size(); ++k)
    limit_step(trajectories_[k], static_cast<int>(phases[k]), time, limits);
  return limits;
}

double Control::next_breakpoint(double time, const double* phases) const {
  const double knot = step_limits(time, phases).knot;
  return is_sampled() ? std::min(knot, sampler_.next_instant(time, phases + trajectories_.size())) : knot;
}

bool Control::controls(int joint) const { return contains(joints_, joint); }

void Control::set_motions(double time, const double* phases, double* q, double* qd) const {
  for (std::size_t i = 0; i < trajectory_of_.size(); ++i) {
    if (!prescribes(static_cast<int>(i))) continue;
    const int k = trajectory_of_[i];
    const JointMotion motion = motion_at(trajectories_[k], static_cast<int>(phases[k]), time);
    q[i] = motion.q;
    qd[i] = motion.qd;
  }
}

void Control::set_mean_accelerations(double time, double h, const double* phases, double* qdd) const {
  for (std::size_t i = 0; i < trajectory_of_.size(); ++i) {
    if (!prescribes(static_cast<int>(i))) continue;
    const Trajectory& trajectory = trajectories_[trajectory_of_[i]];
    const int phase = static_cast<int>(phases[trajectory_of_[i]]);
    const JointMotion start = motion_at(trajectory, phase, time);
    qdd[i] = 2 / h * ((motion_at(trajectory, phase, time + h).q - start.q) / h - start.qd);
  }
}

double Control::jerk(int joint, double time, const double* phases) const {
  const int k = trajectory_of_[joint];
  return k < 0 ? 0 : jerk_at(trajectories_[k], static_cast<int>(phases[k]), time);
}

void Control::add_feedback(double time, const double* phases, const double* q, const double* qd,
                           const double* inputs, const std::vector<JointVariable>& variables, double* columns,
                           std::size_t length) {
  add_gains(variables, columns, length);
  // the feed-forward torques do not depend on the state
  if (!internal_model_ || law_ == Law::feed_forward) return;

  // forward differences of the internal model
  constexpr double step = 1.5e-8;  // square root of the rounding error
  const std::size_t n = trajectory_of_.size(), first_force = variables.size() - joints_.size();
  std::copy_n(q, n, changed_.q.begin());
  std::copy_n(qd, n, changed_.qd.begin());
  std::copy_n(inputs, n, changed_.inputs.begin());
  std::vector<double>& torques = internal_model_->torques;
  model_torques(time, phases, q, qd, inputs, torques.data());
  for (std::size_t v = 0; v < first_force; ++v) {
    double& value = changed_.value(variables[v]);
    const double at = value, h = step * std::max(1.0, std::abs(at));
    value = at + h;
    model_torques(time, phases, changed_.q.data(), changed_.qd.data(), changed_.inputs.data(),
                  changed_.torques.data());
    value = at;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const double change = changed_.torques[joints_[k]] - torques[joints_[k]];
      add_force_column(v, change / h, first_force + k, columns, length);
    }
  }
}

double& Control::Changed::value(JointVariable variable) {
  switch (variable.kind) {
    case JointVariable::Kind::position:
      return q[variable.joint];
    case JointVariable::Kind::velocity:
      return qd[variable.joint];
    case JointVariable::Kind::force:
      break;
  }
  return inputs[variable.joint];
}

// d tau = -kp d q - kd d qd
void Control::add_gains(const std::vector<JointVariable>& variables, double* columns,
                        std::size_t length) const {
  if (law_ == Law::computed_torque) return;
  const std::size_t first_force = variables.size() - joints_.size();
  for (std::size_t v = 0; v < first_force; ++v)
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const auto [kind, joint] = variables[v];
      if (joint != joints_[k] || kind == JointVariable::Kind::force) continue;
      const double gain = kind == JointVariable::Kind::position ? gains_[k].kp : gains_[k].kd;
      add_force_column(v, -gain, first_force + k, columns, length);
    }
}

}  // namespace redysim
