#include "integrate/system/dense_jacobian.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/ball.hpp"
#include "integrate/system/ball_change.hpp"

namespace redysim {

DenseJacobian::DenseJacobian(System& system, bool by_inputs)
    : system_(system),
      derivatives_(system.plan()),
      qdd_(static_cast<std::size_t>(system.plan().nv)),
      tau_(qdd_),
      change_(qdd_.size() + 1 + static_cast<std::size_t>(system.layout().actuators())) {
  using Kind = JointVariable::Kind;
  for (Kind kind : {Kind::position, Kind::velocity})
    for (int k = 0; k < system.simple(); ++k) variables_.push_back({kind, system.joint_of(k)});
  for (int chart : system.plan().balls)
    for (Kind kind : {Kind::position, Kind::velocity, Kind::force})
      for (int k = 1; k <= 3; ++k) variables_.push_back({kind, chart + k});
  add_drives(by_inputs);
  columns_.resize(variables_.size() * change_.size());
}

// Adds the forces of actuators, of all other joints if requested, and last those of controlled joints, as
// Control::add_feedback expects.
void DenseJacobian::add_drives(bool all) {
  const Control* control = system_.control();
  const Actuators* actuators = system_.actuators();
  const auto add = [this](int joint) { variables_.push_back({JointVariable::Kind::force, joint}); };
  const auto is_free = [&](int joint) { return !control || !control->controls(joint); };
  const std::size_t first = variables_.size();
  for (int k = 0; actuators && k < actuators->size(); ++k)
    if (is_free(actuators->joint(k))) add(actuators->joint(k));
  for (int k = 0; all && k < system_.simple(); ++k)
    if (const int joint = system_.joint_of(k); is_free(joint) && force_of(joint) < 0) add(joint);
  if (control) std::for_each(control->joints().begin(), control->joints().end(), add);
  for (int k = 0; actuators && k < actuators->size(); ++k) {
    std::size_t v = first;
    while (variables_[v].joint != actuators->joint(k)) ++v;
    force_variable_.push_back(static_cast<int>(v));
  }
}

// Index of a joint's force in variables_, or -1.
int DenseJacobian::force_of(int joint) const {
  for (std::size_t v = 0; v < variables_.size(); ++v)
    if (variables_[v].kind == JointVariable::Kind::force && variables_[v].joint == joint)
      return static_cast<int>(v);
  return -1;
}

bool DenseJacobian::by_input(int joint, double* column_of_input) const {
  const int place = force_of(joint);
  if (place < 0) return false;
  std::fill_n(column_of_input, system_.size(), 0.0);
  add_rows(column(place), column_of_input);
  return true;
}

Status DenseJacobian::evaluate(double time, const double* y, double* matrix, double* slope) {
  const Status status = system_.accelerations(time, y, qdd_.data());
  if (status != Status::ok) return status;
  if (slope != nullptr) system_.slope_from(y, qdd_.data(), slope);
  const System::Coordinates at = system_.coordinates(time, y);
  system_.drive_forces(at, qdd_.data(), tau_.data());
  derivatives_.evaluate(system_.plan(), system_.workspace(), at.q, at.qd, qdd_.data(), tau_.data(),
                        system_.recursion_port_wrenches(), variables_, columns_.data(), change_.size());
  const StateLayout& layout = system_.layout();
  const std::ptrdiff_t size = system_.size();
  std::fill_n(matrix, size * size, 0.0);
  if (system_.actuators()) add_actuators(y, matrix);
  if (system_.control()) system_.add_feedback(time, at, variables_, columns_.data(), change_.size());
  for (int k = 0; k < layout.q.count; ++k) {
    add_rows(column(k), matrix + layout.q[k] * size);
    double* by_velocity = matrix + layout.qd[k] * size;
    add_rows(column(layout.q.count + k), by_velocity);
    by_velocity[layout.q[k]] = 1;
  }
  for (int ball = 0; ball < system_.balls(); ++ball) set_ball(ball, y, matrix);
  // one sum finds any non-finite entry
  double sum = 0;
  for (std::ptrdiff_t i = 0; i < size * size; ++i) sum += matrix[i] * 0.0;
  return sum == 0 ? Status::ok : Status::recoverable;
}

// Sets the rows of velocities, actuator states and work in a column. `change`: changes of all joint
// accelerations, of the power and of the slopes of actuator states.
void DenseJacobian::add_rows(const double* change, double* column) const {
  const StateLayout& layout = system_.layout();
  for (int i = 0; i < layout.qd.count; ++i) column[layout.qd[i]] = change[system_.joint_of(i)];
  for (int ball = 0; ball < system_.balls(); ++ball) {
    const Eigen::Map<const Vec3<double>> accelerations(change + system_.plan().balls[ball] + 1);
    Eigen::Map<Vec3<double>>(layout.omega.of(column, ball)) =
        rate_matrix(system_.angles_of_ball(ball)) * accelerations;
  }
  if (system_.with_work()) *layout.work.of(column) = change[qdd_.size()];
  for (int i = 0; i < layout.actuators(); ++i) column[layout.motor_q.begin + i] = change[qdd_.size() + 1 + i];
}

// Replaces the columns of actuator forces by those of actuator inputs; adds to the columns of their joints
// and sets those of their states.
void DenseJacobian::add_actuators(const double* y, double* matrix) {
  for (std::size_t v = 0; v < variables_.size(); ++v)
    std::fill(column(static_cast<int>(v)) + qdd_.size() + 1, column(static_cast<int>(v)) + change_.size(),
              0.0);
  for (int k = 0; k < system_.actuators()->size(); ++k) add_actuator(k, y, matrix);
}

void DenseJacobian::add_actuator(int index, const double* y, double* matrix) {
  const Actuators& actuators = *system_.actuators();
  const StateLayout& layout = system_.layout();
  const Actuators::Places place = actuators.places(index);
  const int joint = actuators.joint(index);
  int state = 0;
  while (system_.joint_of(state) != joint) ++state;
  const ActuatorGradient by =
      gradient(actuators.law(index),
               actuators.point(index, y, y[layout.q[state]], y[layout.qd[state]], actuators.input(index)),
               actuators.is_resting());
  double* force = column(force_variable_[index]);
  // `to` += derivative by an entry of the actuator's point
  const auto add = [&](ActuatorGradient::Entry entry, double* to) {
    const ActuatorResponse<Dual>& change = by.by[entry];
    for (std::size_t i = 0; i < change_.size(); ++i) to[i] += change.torque.derivative * force[i];
    double* slopes = to + qdd_.size() + 1 - layout.motor_q.begin;
    to[qdd_.size()] += change.power.derivative;
    if (place.motor_qd >= 0) slopes[place.motor_qd] += change.motor_qdd.derivative;
    if (place.current >= 0) slopes[place.current] += change.current_rate.derivative;
    if (place.lagged >= 0) slopes[place.lagged] += change.lagged_rate.derivative;
  };
  add(ActuatorGradient::q, column(state));
  add(ActuatorGradient::qd, column(layout.q.count + state));
  const std::ptrdiff_t size = system_.size();
  const auto add_state = [&](ActuatorGradient::Entry entry, int of) {
    if (of < 0) return;
    std::fill(change_.begin(), change_.end(), 0.0);
    add(entry, change_.data());
    add_rows(change_.data(), matrix + of * size);
  };
  add_state(ActuatorGradient::motor_q, place.motor_q);
  add_state(ActuatorGradient::motor_qd, place.motor_qd);
  add_state(ActuatorGradient::current, place.current);
  add_state(ActuatorGradient::lagged, place.lagged);
  if (place.motor_q >= 0 && !actuators.is_resting()) matrix[place.motor_qd * size + place.motor_q] = 1;
  std::fill(change_.begin(), change_.end(), 0.0);
  add(ActuatorGradient::input, change_.data());
  std::copy(change_.begin(), change_.end(), force);
}

// Uses the chain rule: dual numbers give the derivatives of the angles, rates and forces.
BallStateChange ball_state_change(const System& system, int ball, const double* y, const double* qdd,
                                  int variable) {
  const StateLayout& layout = system.layout();
  const double* quaternion = layout.quaternion.of(y, ball);
  const Vec3<double> omega(layout.omega.of(y, ball)), torque(system.recursion_ball_torque(ball));
  const BallAngles angles = system.angles_of_ball(ball);
  BallStateChange change;
  const bool velocity = variable >= 4;
  double unit[4] = {0, 0, 0, 0};
  unit[velocity ? variable - 4 : variable] = 1;
  quaternion_rate(velocity ? quaternion : unit, velocity ? unit : omega.data(),
                  change.quaternion_rate.data());

  Vec3<double> turn = Vec3<double>::Zero(), spin = turn;
  if (velocity) {
    spin[variable - 4] = 1;
  } else {
    turn = rotation_vector(quaternion, unit);
  }
  change.angles = angle_rates(angles, turn);
  const BallAnglesOf<Dual> moved{angles.turned, Dual(angles.phi, change.angles[0]),
                                 Dual(angles.theta, change.angles[1]), Dual(angles.psi, change.angles[2])};
  Vec3<Dual> rates = omega.cast<Dual>();
  for (int k = 0; k < 3; ++k) rates[k].derivative = spin[k];
  rates = angle_rates(moved, rates);
  const Vec3<Dual> forces = rate_matrix(moved).transpose() * Vec3<Dual>(torque.cast<Dual>());
  // the link axes rotate as well
  const Eigen::Map<const Vec3<double>> held(qdd + system.plan().balls[ball] + 1);
  const Vec3<Dual> own = rate_matrix(moved) * Vec3<Dual>(held.cast<Dual>()) + rate_bias(moved, rates);
  for (int k = 0; k < 3; ++k) {
    change.rates[k] = rates[k].derivative;
    change.forces[k] = forces[k].derivative;
    change.alpha[k] = own[k].derivative;
  }
  return change;
}

// Sets the columns of a spherical joint's quaternion and angular velocity, from the derivatives of all
// accelerations by its angles, rates and forces.
void DenseJacobian::set_ball(int ball, const double* y, double* matrix) {
  const StateLayout& layout = system_.layout();
  const std::ptrdiff_t size = system_.size();
  const double* columns = column(2 * layout.q.count + 9 * ball);
  for (int variable = 0; variable < 7; ++variable) {
    const BallStateChange of = ball_state_change(system_, ball, y, qdd_.data(), variable);
    double* column = matrix + size * (variable >= 4 ? layout.omega[ball] + variable - 4
                                                    : layout.quaternion[ball] + variable);
    Eigen::Map<Eigen::Vector4d>(layout.quaternion.of(column, ball)) = of.quaternion_rate;
    std::fill(change_.begin(), change_.end(), 0.0);
    for (int k = 0; k < 9; ++k) {
      const double factor = k < 3 ? of.angles[k] : k < 6 ? of.rates[k - 3] : of.forces[k - 6];
      for (std::size_t i = 0; i < change_.size(); ++i)
        change_[i] += factor * columns[static_cast<std::size_t>(k) * change_.size() + i];
    }
    add_rows(change_.data(), column);
    Eigen::Map<Vec3<double>>(layout.omega.of(column, ball)) += of.alpha;
  }
}

}  // namespace redysim
