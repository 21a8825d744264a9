#include <cmath>

#include "dynamics/ground_motion.hpp"
#include "fmi/boundary/arrays.hpp"
#include "fmi/instance/instance.hpp"
#include "integrate/system/tangent.hpp"
#include "model/read/number.hpp"

// Exact derivatives of outputs: along a direction of the knowns at a held state, and by time.

namespace redysim {
namespace {

// The unit quaternion of a rotation that changes by `turn` (in its own axes): how it changes.
double quaternion_change(Eigen::Vector4d quaternion, const Vec3<double>& turn, int element) {
  double rate[4];
  quaternion.normalize();
  quaternion_rate(quaternion.data(), turn.data(), rate);
  return rate[element];
}

double frame_change(const Variable& variable, const GroundState<Dual>& body, const Pose& in_body) {
  const int element = variable.element;
  const PointMotion<Dual> point = point_motion(body, Vec3<Dual>(in_body.position.cast<Dual>()));
  switch (variable.role) {
    case Role::frame_position:
      return point.position[element].derivative;
    case Role::frame_velocity:
      return point.velocity[element].derivative;
    case Role::frame_angular_velocity:
      return body.omega[element].derivative;
    default:
      break;
  }
  const Mat3<Dual> R = body.rotation * Mat3<Dual>(in_body.rotation.cast<Dual>());
  if (variable.role == Role::frame_rotation) return R(element / 3, element % 3).derivative;
  Mat3<double> value, spin;  // spin = R^T dR
  for (int i = 0; i < 9; ++i) value(i / 3, i % 3) = R(i / 3, i % 3).value;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      spin(i, j) = 0;
      for (int k = 0; k < 3; ++k) spin(i, j) += value(k, i) * R(k, j).derivative;
    }
  const Eigen::Quaterniond q(value);
  const double sign = q.w() < 0 ? -1 : 1;
  return sign *
         quaternion_change({q.w(), q.x(), q.y(), q.z()}, {spin(2, 1), spin(0, 2), spin(1, 0)}, element);
}

Mat3<double> inertia_direction(int element, double change) {
  constexpr int rows[] = {0, 1, 2, 0, 0, 1}, columns[] = {0, 1, 2, 1, 2, 2};
  Mat3<double> direction = Mat3<double>::Zero();
  direction(rows[element], columns[element]) = direction(columns[element], rows[element]) = change;
  return direction;
}

}  // namespace

fmi2Status Instance::get_directional_derivative(const unsigned* unknowns, std::size_t unknown_count,
                                                const unsigned* knowns, std::size_t known_count,
                                                const double* directions, double* derivatives) {
  constexpr Function function = Function::get_directional_derivative;
  const char* objection = objection_to_arrays(unknown_count, {unknowns, derivatives});
  if (!objection) objection = objection_to_arrays(known_count, {knowns, directions});
  if (objection) return refuse(function, objection);
  for (std::size_t i = 0; i < known_count; ++i) {
    const Variable* variable = table_.real(knowns[i]);
    if (!variable) return refuse(function, unknown_reference(knowns[i], "Real"));
    const std::string why = why_no_direction(*variable, directions[i]);
    if (!why.empty()) return refuse(function, why);
  }
  if (!take_tangent(function)) return fmi2Error;
  bool jumps = false;
  for (std::size_t i = 0; i < known_count; ++i) {
    const Variable& variable = *table_.real(knowns[i]);
    set_direction(variable, directions[i]);
    jumps = jumps || variable.role == Role::motion_q || variable.role == Role::motion_qd;
  }
  if (state_ == State::initialization) {
    const char* why = system_.has_loops() ? tangent_->follow_assembly(model_, assembly_) : nullptr;
    if (why) return refuse(function, "there are no derivatives along this direction: " + std::string(why));
    work_change_ = WorkChange::none;
  } else {
    if (jumps && !settled_ && !landed_)
      return refuse(function, "there are no derivatives: the joints cannot follow the prescribed motion");
    if (jumps && integrator_) tangent_->follow_jumps(system_, time_, integrator_->state());
    work_change_ = WorkChange::of_energy;
  }
  return read_tangent(function, unknowns, unknown_count, derivatives);
}

fmi2Status Instance::get_real_output_derivatives(const unsigned* references, std::size_t count,
                                                 const int* orders, double* values) {
  constexpr Function function = Function::get_real_output_derivatives;
  if (const char* why = objection_to_arrays(count, {references, orders, values}))
    return refuse(function, why);
  bool simple = true;  // q' and qd' need no dual numbers
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = table_.real(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], "Real"));
    if (variable->causality != Causality::output || variable->variability != Variability::continuous)
      return refuse(function, variable->name + " is not a continuous output: it has no derivatives");
    if (orders[i] != 1)
      return refuse(function, variable->name + ": the order must be 1, got " + std::to_string(orders[i]));
    simple = simple && (variable->role == Role::q || variable->role == Role::qd);
  }
  if (!simple) {
    if (!take_tangent(function)) return fmi2Error;
    tangent_->go_with_time(system_, time_, current_state());
    work_change_ = WorkChange::by_power;
    return read_tangent(function, references, count, values);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Variable& variable = *table_.real(references[i]);
    if (variable.role == Role::qd && !update_accelerations(function)) return fmi2Error;
    values[i] = variable.role == Role::qd ? qdd_[variable.joint]
                                          : system_.coordinates(time_, current_state()).qd[variable.joint];
  }
  return fmi2OK;
}

// What the outputs are derived by: inputs, and while they may be set start values and tunable parameters.
std::string Instance::why_no_direction(const Variable& variable, double direction) const {
  if (!std::isfinite(direction))
    return "the direction of " + variable.name + " must be a finite number, got " + shown(direction);
  const bool start = variable.role == Role::q0 || variable.role == Role::qd0;
  const bool ball_start = variable.role == Role::ball_quaternion0 || variable.role == Role::ball_omega0;
  if (variable.causality == Causality::output) return variable.name + " is an output and no known";
  if (variable.causality == Causality::input) return {};
  if (!start && !ball_start && variable.variability != Variability::tunable)
    return "no derivatives exist with respect to " + variable.name;
  if (state_ != State::initialization)
    return "there are derivatives by " + variable.name + " in initialization mode alone";
  return {};
}

bool Instance::take_tangent(Function function) {
  if (!update_accelerations(function)) return false;
  if (!tangent_) tangent_ = std::make_unique<Tangent>(model_, system_);
  tangent_->go_to(model_, system_, time_, current_state());
  return true;
}

void Instance::set_direction(const Variable& variable, double direction) {
  Tangent& to = *tangent_;
  const int joint = variable.joint, element = variable.element;
  switch (variable.role) {
    case Role::tau:
    case Role::port_torque:
    case Role::port_force:
      to.force[force_index(variable)].derivative += direction;
      return;
    case Role::motion_qdd:
      to.force[joint].derivative += direction;
      return;
    case Role::q0:
    case Role::motion_q:
      to.q[joint].derivative += direction;
      return;
    case Role::qd0:
    case Role::motion_qd:
      to.qd[joint].derivative += direction;
      return;
    case Role::ball_tau:
      to.balls[variable.ball].torque[element] += direction;
      return;
    case Role::ball_quaternion0:
      to.balls[variable.ball].quaternion[element] += direction;
      return;
    case Role::ball_omega0:
      to.balls[variable.ball].omega[element] += direction;
      return;
    case Role::gravity:
      for (Plan<Dual>* plan : to.plans()) plan->gravity[element].derivative += direction;
      return;
    case Role::kp:
      to.control()->gains(joint)->kp.derivative += direction;
      return;
    case Role::kd:
      to.control()->gains(joint)->kd.derivative += direction;
      return;
    case Role::target:
      to.control()->gains(joint)->target.derivative += direction;
      return;
    default:
      set_parameter_direction(variable, direction);
  }
}

void Instance::set_parameter_direction(const Variable& variable, double direction) {
  if (variable.role == Role::mass || variable.role == Role::com || variable.role == Role::inertia) {
    const Link& link = model_.links[variable.link];
    const int body = plan_.carrier[variable.link];
    Vec3<double> com = Vec3<double>::Zero();
    Mat3<double> inertia = Mat3<double>::Zero();
    if (variable.role == Role::com) com[variable.element] = direction;
    if (variable.role == Role::inertia) inertia = inertia_direction(variable.element, direction);
    tangent_->change_mass(body, plan_.frame_in_carrier[variable.link], link.com, link.mass,
                          variable.role == Role::mass ? direction : 0, com, inertia);
    return;
  }
  if (variable.joint < 0) return;  // of a joint that does not move
  for (Plan<Dual>* plan : tangent_->plans()) {
    JointPlan<Dual>& joint = plan->joints[variable.joint];
    if (variable.role == Role::armature) {
      joint.armature.derivative += direction;
      joint.axis_free = false;
      continue;
    }
    joint.passive = true;
    if (variable.role >= Role::friction && variable.role <= Role::stop_width) {
      set_resistance_direction(*plan, variable, direction);
      continue;
    }
    Dual& value = variable.role == Role::damping     ? joint.damping
                  : variable.role == Role::stiffness ? joint.stiffness
                                                     : joint.rest;
    value.derivative += direction;
  }
}

// Friction and stops, as the plan makes them of a joint's parameters.
void Instance::set_resistance_direction(Plan<Dual>& plan, const Variable& variable, double direction) {
  const Joint& given = model_.links[variable.link].joint;
  Resistance<Dual>& to = plan.resistances[variable.joint];
  const bool peak = given.static_friction > given.friction;
  JointPlan<Dual>& joint = plan.joints[variable.joint];
  joint.passive = joint.resists = joint.rubs = true;
  joint.stopped = has_stops(given);
  switch (variable.role) {
    case Role::friction:
      to.friction.derivative += direction;
      if (peak) to.excess.derivative -= direction;
      return;
    case Role::static_friction:
      if (peak) to.excess.derivative += direction;
      return;
    case Role::friction_velocity:
      to.per_velocity.derivative -= direction / (given.friction_velocity * given.friction_velocity);
      return;
    case Role::lower:
      to.lower.derivative += direction;
      return;
    case Role::upper:
      to.upper.derivative += direction;
      return;
    case Role::stop_stiffness:
      to.stiffness.derivative += direction;
      return;
    case Role::stop_damping:
      to.damping.derivative += direction;
      return;
    default:  // stop_width
      to.width.derivative += direction;
  }
}

fmi2Status Instance::read_tangent(Function function, const unsigned* references, std::size_t count,
                                  double* derivatives) {
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = table_.real(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], "Real"));
    if (variable->causality != Causality::output)
      return refuse(function, variable->name + " is not an output: it has no derivatives");
  }
  if (!tangent_->evaluate()) return refuse(function, "the derivatives are not finite");
  for (std::size_t i = 0; i < count; ++i) derivatives[i] = read_direction(*table_.real(references[i]));
  return fmi2OK;
}

double Instance::read_direction(const Variable& variable) {
  Tangent& at = *tangent_;
  const int joint = variable.joint, element = variable.element;
  switch (variable.role) {
    case Role::q:
      return at.q[joint].derivative;
    case Role::qd:
      return at.qd[joint].derivative;
    case Role::qdd:
      return at.qdd[joint].derivative;
    case Role::motion_tau:
      return at.drive[joint].derivative;
    case Role::reference_q:
      return at.control()->reference_q(joint).derivative;
    case Role::reference_qd:
      return at.control()->reference_qd(joint).derivative;
    case Role::ball_quaternion:
      return quaternion_change(
          Eigen::Map<const Eigen::Vector4d>(system_.layout().quaternion.of(current_state(), variable.ball)),
          at.ball(variable.ball).turn, element);
    case Role::ball_omega:
      return at.ball(variable.ball).omega[element].derivative;
    case Role::ball_alpha:
      return at.ball(variable.ball).alpha[element].derivative;
    case Role::ball_angle: {
      const double* quaternion = system_.layout().quaternion.of(current_state(), variable.ball);
      return angle_rates(angles_in_chart(rotation_of(quaternion), false),
                         at.ball(variable.ball).turn)[element];
    }
    case Role::lambda: {
      const LoopPlan<double>& loop = plan_.loops[variable.plan_loop];
      for (std::size_t k = 0; k < loop.rows.size(); ++k)
        if (loop.rows[k].index == element)
          return at.multipliers[static_cast<std::size_t>(loop.first_row) + k].derivative;
      return 0;
    }
    case Role::linear_momentum:
      return at.momentum().force[element].derivative;
    case Role::angular_momentum:
      return at.momentum().moment[element].derivative;
    case Role::kinetic_energy:
      return at.kinetic_energy().derivative;
    case Role::potential_energy:
      return at.potential_energy().derivative;
    case Role::total_energy:
    case Role::work:
    case Role::energy_balance:
      return energy_direction(variable.role);
    default:
      break;
  }
  if (variable.frame < 0) return 0;  // gaps stay closed; the solver's health is no function of the knowns
  const Frame& frame = model_.frames[variable.frame];
  return frame_change(variable, at.body(plan_.carrier[frame.link]),
                      plan_.frame_in_carrier[frame.link] * Pose{frame.rotation, frame.position});
}

// Where motions jump the work counts what the energy gains.
double Instance::energy_direction(Role role) {
  const double total = tangent_->kinetic_energy().derivative + tangent_->potential_energy().derivative;
  if (role == Role::total_energy) return total;
  const double work = work_change_ == WorkChange::by_power    ? tangent_->power.value
                      : work_change_ == WorkChange::of_energy ? total
                                                              : 0;
  if (role == Role::work) return work;
  return work_change_ == WorkChange::none ? 0 : total - work;
}

}  // namespace redysim
