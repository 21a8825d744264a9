#include <algorithm>
#include <cmath>

#include "dynamics/derivatives.hpp"
#include "fmi/instance/derivatives.hpp"
#include "integrate/system/ball_change.hpp"

// Adjoint derivatives by one reverse sweep, for models without controllers. Unknowns and knowns are states,
// their derivatives, and force inputs.

namespace redysim {

struct OutputDerivatives::Reverse {
  explicit Reverse(const Plan<double>& plan) : derivatives(plan) {}
  Derivatives derivatives;
  Derivatives::Gradient row;
  std::vector<double> slopes, states;  // weights of the entries of y' and y; then `states` is the result
  std::vector<double> forces;          // result for the inputs (InputLayout)
  double power() const { return work < 0 ? 0 : slopes[static_cast<std::size_t>(work)]; }
  int work = -1;  // index in y, or -1
};

OutputDerivatives::OutputDerivatives(Simulation& simulation, CurrentState& state, Values& values)
    : simulation_(simulation), state_(state), values_(values) {}

OutputDerivatives::~OutputDerivatives() = default;

// False: the unknown is not a state or a derivative of a state.
[[gnu::cold]] bool OutputDerivatives::add_weight(const Variable& unknown, double weight) {
  const Row& row = *unknown.row;
  const int state = values_.place(unknown), slope = values_.place_of_slope(unknown);
  const int contact_work = reverse_->work + 1;
  if (state < 0 && slope < 0) return false;
  if (reverse_->work >= 0 && slope == contact_work) return false;
  // outputs show unnormalised quaternions, but joints in loops where the loops are closed
  if (row.state == StatePart::quaternion) return false;
  if (state >= 0)
    reverse_->states[static_cast<std::size_t>(state)] += weight;
  else
    reverse_->slopes[static_cast<std::size_t>(slope)] += weight;
  return true;
}

// Result for a known; null: it is not supported.
const double* OutputDerivatives::gradient(const Variable& known) const {
  const System& system = simulation_.system;
  if (known.is_calculated()) {
    const int place = values_.place(known);
    const bool depends = system.has_constraints() && values_.exchanged_place(known) < 0;
    if (place < 0 || depends) return nullptr;
    return &reverse_->states[static_cast<std::size_t>(place)];
  }
  if (known.row->storage != Storage::input) return nullptr;
  const std::size_t input = static_cast<std::size_t>(known.group->input(known.row_index(), system, known));
  return input < reverse_->forces.size() ? &reverse_->forces[input] : nullptr;
}

// Sets the weights of the joint accelerations, then computes the results for states and inputs.
[[gnu::cold]] bool OutputDerivatives::sweep_back() {
  System& system = simulation_.system;
  const Plan<double>& plan = simulation_.plan;
  const StateLayout& layout = system.layout();
  const InputLayout& inputs = system.input_layout();
  Reverse& reverse = *reverse_;
  Derivatives::Gradient& row = reverse.row;
  if (!values_.update(Needs::parameters).empty()) return false;
  const double* y = state_.y();
  const std::size_t n = static_cast<std::size_t>(plan.nv);
  std::vector<double> qdd(n), tau(n), weights(n);
  if (system.accelerations(simulation_.time, y, qdd.data()) != Status::ok) return false;
  const System::Coordinates at = system.coordinates(simulation_.time, y);
  system.drive_forces(at, qdd.data(), tau.data());
  for (int k = 0; k < system.simple(); ++k)
    weights[static_cast<std::size_t>(system.joint_of(k))] =
        reverse.slopes[static_cast<std::size_t>(layout.qd[k])];
  for (int ball = 0; ball < system.balls(); ++ball) {
    Eigen::Map<Vec3<double>> angles(weights.data() + plan.balls[ball] + 1);
    angles = rate_matrix(system.angles_of_ball(ball)).transpose() *
             Vec3<double>(layout.omega.of(reverse.slopes.data(), ball));
  }
  reverse.derivatives.evaluate_row(plan, system.workspace(), at.q, at.qd, qdd.data(), tau.data(),
                                   system.recursion_port_wrenches(), weights.data(), reverse.power(), row);
  values_.changed();  // the workspace was overwritten
  std::copy(row.tau.begin(), row.tau.end(), inputs.tau.of(reverse.forces.data()));
  std::copy(row.ports.begin(), row.ports.end(), inputs.port_wrench.of(reverse.forces.data()));
  if (system.actuators()) pull_actuators(at);
  for (int k = 0; k < system.simple(); ++k) {
    const std::size_t joint = static_cast<std::size_t>(system.joint_of(k));
    reverse.states[static_cast<std::size_t>(layout.q[k])] += row.q[joint];
    reverse.states[static_cast<std::size_t>(layout.qd[k])] +=
        row.qd[joint] + reverse.slopes[static_cast<std::size_t>(layout.q[k])];
  }
  for (int ball = 0; ball < system.balls(); ++ball) pull_ball(ball, qdd.data());
  return true;
}

// Propagates from the angles and rates of a spherical joint to its quaternion and angular velocity.
[[gnu::cold]] void OutputDerivatives::pull_ball(int ball, const double* qdd) {
  System& system = simulation_.system;
  const StateLayout& layout = system.layout();
  Reverse& reverse = *reverse_;
  const std::size_t first = static_cast<std::size_t>(simulation_.plan.balls[ball]) + 1;
  const Eigen::Map<const Vec3<double>> by_angles(&reverse.row.q[first]), by_rates(&reverse.row.qd[first]),
      by_forces(&reverse.row.tau[first]), by_alpha(layout.omega.of(reverse.slopes.data(), ball));
  const Eigen::Map<const Eigen::Vector4d> by_rate(layout.quaternion.of(reverse.slopes.data(), ball));
  for (int variable = 0; variable < 7; ++variable) {
    const BallStateChange change = ball_state_change(system, ball, state_.y(), qdd, variable);
    double& to = variable < 4 ? layout.quaternion.of(reverse.states.data(), ball)[variable]
                              : layout.omega.of(reverse.states.data(), ball)[variable - 4];
    to += by_angles.dot(change.angles) + by_rates.dot(change.rates) + by_forces.dot(change.forces) +
          by_alpha.dot(change.alpha) + by_rate.dot(change.quaternion_rate);
  }
  Eigen::Map<Vec3<double>>(system.input_layout().ball_torque.of(reverse.forces.data(), ball)) =
      rate_matrix(system.angles_of_ball(ball)) * by_forces;
}

// Propagates from the torques on joints to the inputs and states of their actuators.
[[gnu::cold]] void OutputDerivatives::pull_actuators(const System::Coordinates& at) {
  const System& system = simulation_.system;
  const Actuators& actuators = *system.actuators();
  Reverse& reverse = *reverse_;
  const auto weight = [&](int place) {
    return place < 0 ? 0.0 : reverse.slopes[static_cast<std::size_t>(place)];
  };
  for (int k = 0; k < actuators.size(); ++k) {
    const std::size_t joint = static_cast<std::size_t>(actuators.joint(k));
    const Actuators::Places place = actuators.places(k);
    const ActuatorGradient by = gradient_of(k, at);
    double* torque = &reverse.forces[joint];
    const double by_torque = *torque;
    const auto product = [&](ActuatorGradient::Entry entry) {
      const ActuatorResponse<Dual>& change = by.by[entry];
      return by_torque * change.torque.derivative + reverse.power() * change.power.derivative +
             weight(place.motor_qd) * change.motor_qdd.derivative +
             weight(place.current) * change.current_rate.derivative +
             weight(place.lagged) * change.lagged_rate.derivative;
    };
    const auto add = [&](ActuatorGradient::Entry entry, int to) {
      if (to >= 0) reverse.states[static_cast<std::size_t>(to)] += product(entry);
    };
    reverse.row.q[joint] += product(ActuatorGradient::q);
    reverse.row.qd[joint] += product(ActuatorGradient::qd);
    add(ActuatorGradient::motor_q, place.motor_q);
    add(ActuatorGradient::motor_qd, place.motor_qd);
    add(ActuatorGradient::current, place.current);
    add(ActuatorGradient::lagged, place.lagged);
    if (place.motor_q >= 0) reverse.states[static_cast<std::size_t>(place.motor_qd)] += weight(place.motor_q);
    *torque = product(ActuatorGradient::input);
  }
}

[[gnu::cold]] ActuatorGradient OutputDerivatives::gradient_of(int actuator, const System::Coordinates& at) {
  const Actuators& actuators = *simulation_.system.actuators();
  const int joint = actuators.joint(actuator);
  return redysim::gradient(
      actuators.law(actuator),
      actuators.point(actuator, state_.y(), at.q[joint], at.qd[joint], actuators.input(actuator)), false);
}

// False: an unknown or its derivative is not supported.
bool OutputDerivatives::take_weights(const unsigned* unknowns, std::size_t count, const double* seed) {
  const System& system = simulation_.system;
  const Plan<double>& plan = simulation_.plan;
  if (!reverse_) reverse_ = std::make_unique<Reverse>(plan);
  Reverse& reverse = *reverse_;
  reverse.work = system.with_work() ? system.layout().work.begin : -1;
  for (std::vector<double>* of : {&reverse.slopes, &reverse.states})
    of->assign(static_cast<std::size_t>(system.size()), 0.0);
  reverse.forces.assign(static_cast<std::size_t>(system.input_layout().force_size()), 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* unknown = simulation_.table.real(unknowns[i]);
    if (!unknown || !add_weight(*unknown, seed[i])) return false;
  }
  // the power of ports and prescribed motions has further dependencies
  const bool all_integrated = plan.nv == system.simple() + 4 * system.balls();
  return reverse.power() == 0 || (!plan.has_ports() && all_integrated);
}

bool OutputDerivatives::pull_back(const unsigned* unknowns, std::size_t unknown_count, const unsigned* knowns,
                                  std::size_t known_count, const double* seed, double* sensitivity) {
  if (simulation_.system.control() || !take_weights(unknowns, unknown_count, seed) || !sweep_back())
    return false;
  for (std::size_t k = 0; k < known_count; ++k) {
    const Variable* known = simulation_.table.real(knowns[k]);
    const double* product = known ? gradient(*known) : nullptr;
    if (!product || !std::isfinite(*product)) return false;
    sensitivity[k] = *product;
  }
  return true;
}

}  // namespace redysim
