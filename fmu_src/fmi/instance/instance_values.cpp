#include <cmath>

#include "dynamics/loops/loop_rows.hpp"
#include "dynamics/momentum.hpp"
#include "fmi/boundary/arrays.hpp"
#include "fmi/instance/instance.hpp"
#include "fmi/variables/frame_values.hpp"
#include "fmi/variables/parameters.hpp"
#include "model/features.hpp"
#include "model/read/number.hpp"

// Reading and writing variables by value reference.

namespace redysim {
namespace {

Eigen::Vector4d unit_quaternion(const double* q) { return Eigen::Map<const Eigen::Vector4d>(q).normalized(); }

// ReDySim's angles of R = Rz(phi) Rx(theta) Ry(psi).
Vec3<double> zxy_angles(const double* quaternion) {
  const BallAngles angles = angles_in_chart(rotation_of(quaternion), false);
  return {angles.phi, angles.theta, angles.psi};
}

bool is_motion(Role role) {
  return role == Role::motion_q || role == Role::motion_qd || role == Role::motion_qdd;
}

constexpr const char* null_argument = "an argument is a null pointer";

}  // namespace

std::string Instance::unknown_reference(unsigned reference, const char* type) {
  return "there is no " + std::string(type) + " variable with value reference " + std::to_string(reference);
}

bool Instance::update_accelerations(Function function) {
  if (qdd_current_) return true;
  if (!update_plan(function)) return false;
  bool finite = system_.accelerations(time_, current_state(), qdd_.data()) == Status::ok;
  for (double value : qdd_) finite = finite && std::isfinite(value);
  if (!finite) {
    const std::string joint = failed_joint_name();
    refuse(function, "the accelerations at " + shown(time_) + " s are not finite" +
                         (joint.empty() ? "" : " (joint '" + joint + "')"));
    return false;
  }
  if (plan_.has_motion() || system_.control())
    system_.drive_forces(system_.coordinates(time_, current_state()), qdd_.data(), drive_.data());
  for (int ball = 0; ball < system_.balls(); ++ball)
    ball_alpha_[ball] = system_.ball_acceleration(ball, qdd_.data());
  return qdd_current_ = true;
}

bool Instance::update_energies(Function function) {
  if (energies_current_) return true;
  if (!update_plan(function)) return false;
  kinetic_energy_ = system_.kinetic_energy(time_, current_state());
  potential_energy_ = system_.potential_energy(time_, current_state());
  return energies_current_ = true;
}

bool Instance::read(Function function, const Variable& variable, double& value) {
  switch (variable.role) {
    case Role::tau:
    case Role::ball_tau:
    case Role::port_torque:
    case Role::port_force:
      value = system_.inputs()[force_index(variable)];
      return true;
    case Role::motion_q:
    case Role::motion_qd:
    case Role::motion_qdd:
      value =
          motion_[3 * variable.joint + (static_cast<int>(variable.role) - static_cast<int>(Role::motion_q))];
      return true;
    case Role::ball_quaternion:
      value =
          unit_quaternion(system_.layout().quaternion.of(current_state(), variable.ball))[variable.element];
      return true;
    case Role::ball_omega:
      value = system_.layout().omega.of(current_state(), variable.ball)[variable.element];
      return true;
    case Role::ball_alpha:
      if (!update_accelerations(function)) return false;
      value = ball_alpha_[variable.ball][variable.element];
      return true;
    case Role::ball_angle:
      value = zxy_angles(system_.layout().quaternion.of(current_state(), variable.ball))[variable.element];
      return true;
    case Role::linear_momentum:
    case Role::angular_momentum:
      value = read_momentum(variable);
      return true;
    case Role::q:
      value = system_.coordinates(time_, current_state()).q[variable.joint];
      return true;
    case Role::qd:
      value = system_.coordinates(time_, current_state()).qd[variable.joint];
      return true;
    case Role::reference_q:
      if (!update_plan(function)) return false;
      value = system_.reference(variable.joint, time_).q;
      return true;
    case Role::reference_qd:
      value = system_.reference(variable.joint, time_).qd;
      return true;
    case Role::motion_tau:
      if (!update_accelerations(function)) return false;
      value = drive_[variable.joint];
      return true;
    case Role::frame_position:
    case Role::frame_quaternion:
    case Role::frame_rotation:
    case Role::frame_velocity:
    case Role::frame_angular_velocity:
      if (!update_accelerations(function)) return false;
      value = read_frame(variable);
      return true;
    case Role::qdd:
      if (!update_accelerations(function)) return false;
      value = qdd_[variable.joint];
      return true;
    case Role::gap:
      if (!update_accelerations(function)) return false;
      value = loop_gap(plan_.loops[variable.plan_loop], system_.workspace());
      return true;
    case Role::lambda:
      if (!update_accelerations(function)) return false;
      value = read_multiplier(variable);
      return true;
    case Role::kinetic_energy:
    case Role::potential_energy:
    case Role::total_energy:
    case Role::energy_balance: {
      if (!update_energies(function)) return false;
      const double total = kinetic_energy_ + potential_energy_;
      value = variable.role == Role::kinetic_energy     ? kinetic_energy_
              : variable.role == Role::potential_energy ? potential_energy_
              : variable.role == Role::total_energy     ? total
              : integrator_ ? total - system_.work(current_state()) - energy_offset_
                            : 0.0;
      return true;
    }
    case Role::work:
      value = system_.work(current_state());
      return true;
    case Role::error_estimate:
      value = integrator_ ? integrator_->statistics().error_estimate : 0.0;
      return true;
    default:
      value = *parameter(model_, variable);
      return true;
  }
}

// Those that a planar scene leaves out are 0.
double Instance::read_multiplier(const Variable& variable) {
  const LoopPlan<double>& loop = plan_.loops[variable.plan_loop];
  for (std::size_t k = 0; k < loop.rows.size(); ++k)
    if (loop.rows[k].index == variable.element)
      return system_.workspace().loop.lambda[static_cast<std::size_t>(loop.first_row) + k];
  return 0;
}

double Instance::read_momentum(const Variable& variable) {
  const System::Coordinates at = system_.coordinates(time_, current_state());
  const Force<double> total = momentum(plan_, system_.workspace(), at.q, at.qd);
  return variable.role == Role::linear_momentum ? total.force[variable.element]
                                                : total.moment[variable.element];
}

double Instance::read_frame(const Variable& variable) {
  const Frame& frame = model_.frames[variable.frame];
  const Pose in_body = plan_.frame_in_carrier[frame.link] * Pose{frame.rotation, frame.position};
  const double* qd = system_.coordinates(time_, current_state()).qd;
  return frame_value(variable, body_motion(plan_, system_.workspace(), plan_.carrier[frame.link], qd),
                     in_body);
}

// Where an input (but a motion) or a parameter lives.
double& Instance::settable_value(const Variable& variable) {
  switch (variable.role) {
    case Role::tau:
    case Role::ball_tau:
    case Role::port_torque:
    case Role::port_force:
      return system_.inputs()[force_index(variable)];
    default:
      return *parameter(model_, variable);
  }
}

// Where an input force lives in System::inputs().
int Instance::force_index(const Variable& variable) const {
  if (variable.role == Role::ball_tau)
    return system_.input_layout().ball_torque[variable.ball] + variable.element;
  if (variable.role != Role::port_torque && variable.role != Role::port_force)
    return system_.input_layout().tau[variable.joint];
  int port = 0;
  while (plan_.ports[port].frame != variable.frame) ++port;
  // moment, then force
  return system_.input_layout().port_wrench[port] + variable.element +
         (variable.role == Role::port_force ? 3 : 0);
}

// A part of a prescribed motion. Some masters set inputs that did not change again and others do not: to both
// the motion is the same.
void Instance::set_motion(const Variable& variable, double value) {
  double* motion = &motion_[3 * variable.joint];
  const int derivative = static_cast<int>(variable.role) - static_cast<int>(Role::motion_q);
  motion_set_[3 * variable.joint + derivative] = 1;
  if (motion[derivative] == value) return;
  motion[derivative] = value;
  if (integrator_)
    system_.change_motion(time_, variable.joint, derivative, value);
  else
    system_.set_motion(time_, variable.joint, motion[0], motion[1], motion[2]);
  values_changed();
  settled_ = !integrator_ || system_.size() == 0;
  settled_state_current_ = false;
  if (system_.has_loops()) start_state_current_ = false;
}

fmi2Status Instance::get_real(const unsigned* references, std::size_t count, double* values) {
  constexpr Function function = Function::get_real;
  if (const char* why = objection_to_arrays(count, {references, values})) return refuse(function, why);
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = table_.real(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], "Real"));
    if (state_ == State::instantiated && variable->causality == Causality::output)
      return refuse(function, variable->name + " has no value before initialization mode");
    double value = 0;
    if (!read(function, *variable, value)) return fmi2Error;
    if (!std::isfinite(value)) return refuse(function, variable->name + " is not finite: " + shown(value));
    values[i] = value;
  }
  return fmi2OK;
}

// Of the method in use, as the description of solver.active lists them.
static long number_of(const Integrator* integrator) {
  switch (integrator ? integrator->method() : SolverMethod::automatic) {
    case SolverMethod::erk:
      return 1;
    case SolverMethod::adams:
      return 2;
    case SolverMethod::dirk:
      return 3;
    case SolverMethod::bdf:
      return 4;
    case SolverMethod::automatic:
      break;
  }
  return 0;
}

fmi2Status Instance::get_integer(const unsigned* references, std::size_t count, int* values) {
  constexpr Function function = Function::get_integer;
  if (const char* why = objection_to_arrays(count, {references, values})) return refuse(function, why);
  const Statistics nothing_yet;
  const Statistics& statistics = integrator_ ? integrator_->statistics() : nothing_yet;
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = table_.integer(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], "Integer"));
    if (state_ == State::instantiated)
      return refuse(function, variable->name + " has no value before initialization mode");
    const long number = variable->role == Role::steps           ? statistics.steps
                        : variable->role == Role::rejected      ? statistics.rejected
                        : variable->role == Role::active_method ? number_of(integrator_.get())
                                                                : statistics.evaluations;
    values[i] =
        number > std::numeric_limits<int>::max() ? std::numeric_limits<int>::max() : static_cast<int>(number);
  }
  return fmi2OK;
}

fmi2Status Instance::get_string(const unsigned* references, std::size_t count, fmi2String* values) {
  constexpr Function function = Function::get_string;
  if (const char* why = objection_to_arrays(count, {references, values})) return refuse(function, why);
  for (std::size_t i = 0; i < count; ++i) {
    if (!table_.string(references[i])) return refuse(function, unknown_reference(references[i], "String"));
    values[i] = method_name(model_.solver.method);  // the only String
  }
  return fmi2OK;
}

std::string Instance::why_not_settable(const Variable& variable) const {
  if (variable.causality == Causality::output) return variable.name + " is an output and cannot be set";
  if (variable.variability == Variability::fixed && state_ == State::step)
    return variable.name + " is a fixed parameter and cannot be set after initialization";
  return {};
}

fmi2Status Instance::set_real(const unsigned* references, std::size_t count, const double* values) {
  constexpr Function function = Function::set_real;
  if (const char* why = objection_to_arrays(count, {references, values})) return refuse(function, why);
  // all are checked before the first is set
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = table_.real(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], "Real"));
    std::string why = why_not_settable(*variable);
    if (why.empty()) why = objection(*variable, values[i]);
    if (!why.empty()) return refuse(function, why);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Variable& variable = *table_.real(references[i]);
    if (is_motion(variable.role)) {
      set_motion(variable, values[i]);
      continue;
    }
    double& value = settable_value(variable);
    if (value == values[i]) continue;
    value = values[i];
    values_changed();
    if (variable.variability == Variability::fixed) start_state_current_ = false;
    if (variable.role == Role::q0 && plan_.joints[variable.joint].prescribed) {
      motion_[3 * variable.joint] = value;  // a locked joint
      anchor_motion();
    }
    if (variable.variability == Variability::tunable) {
      plan_current_ = false;
      parameters_changed_ = true;
      inertia_tuned_ = inertia_tuned_ || is_of_link(variable.role) || variable.role == Role::armature;
    }
  }
  return fmi2OK;
}

fmi2Status Instance::set_integer(const unsigned* references, std::size_t count) {
  constexpr Function function = Function::set_integer;
  if (count == 0) return fmi2OK;
  if (const char* why = objection_to_arrays(count, {references})) return refuse(function, why);
  const Variable* variable = table_.integer(references[0]);
  return refuse(function,
                variable ? why_not_settable(*variable) : unknown_reference(references[0], "Integer"));
}

fmi2Status Instance::set_string(const unsigned* references, std::size_t count, const fmi2String* values) {
  constexpr Function function = Function::set_string;
  if (const char* why = objection_to_arrays(count, {references, values})) return refuse(function, why);
  SolverMethod method = model_.solver.method;
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = table_.string(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], "String"));
    const std::string why = why_not_settable(*variable);
    if (!why.empty()) return refuse(function, why);
    if (!values[i]) return refuse(function, null_argument);
    if (!parse_method(values[i], method))
      return refuse(function, variable->name + " must be " + method_names() + ", got '" + values[i] + "'");
  }
  if (!has_method(method))
    return refuse(function, "this library was specialised for its scene and does not hold the method " +
                                std::string(method_name(method)));
  model_.solver.method = method;
  return fmi2OK;
}

fmi2Status Instance::no_booleans(Function function, std::size_t count) {
  return count == 0 ? fmi2OK : refuse(function, "there are no Boolean variables");
}

}  // namespace redysim
