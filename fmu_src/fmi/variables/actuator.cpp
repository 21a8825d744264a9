#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/drive.hpp"
#include "fmi/variables/entry.hpp"
#include "fmi/variables/parameters.hpp"

// Outputs and tunable parameters of a joint's actuator. Its input is defined in joint.cpp.

namespace redysim {

bool has_inductance(const Scene& scene, const Variable& variable) {
  return takes_voltage(scene, variable) && actuator_of(scene.model, variable)->inductance > 0;
}

namespace {

bool has_limits(const Scene& scene, const Variable& variable) {
  return actuator_with<&Actuator::limits_torque>(scene, variable) ||
         actuator_with<&Actuator::limits_speed>(scene, variable);
}

int actuator_index(OutputDerivatives& of, const Variable& v) {
  return of.values().system().actuators()->at(v.joint);
}

double read_state(Values& at, const Variable& v) { return at.state(v); }

double state_derivative(OutputDerivatives& of, const Variable& v) {
  return of.tangent().state(of.values().place(v)).derivative;
}

constexpr Entry joint_torque_entry =
    output(Owner::joint, "tau_joint")
        .reads([](Values& at, const Variable& v) { return at.drive_force(v.joint); }, Needs::accelerations)
        .derivative(
            [](OutputDerivatives& of, const Variable& v) { return of.tangent().drive[v.joint].derivative; })
        .depends(at_point::accelerations, initially::accelerations)
        .measures(quantity::torque, quantity::force)
        .says("Torque of the actuator on %", "Force of the actuator on %");

constexpr Entry motor_angle_entry = output(Owner::joint, "motor_q")
                                        .in(OutputGroup::actuator)
                                        .there_if(actuator_with<&Actuator::is_elastic>)
                                        .is_state(StatePart::motor_q)
                                        .reads(read_state)
                                        .derivative(state_derivative)
                                        .rate_is_next()
                                        .depends(nullptr, initially::position)
                                        .measures(quantity::angle)
                                        .says("Angle of the motor of %");

constexpr Entry motor_velocity_entry = output(Owner::joint, "motor_qd")
                                           .in(OutputGroup::actuator)
                                           .there_if(actuator_with<&Actuator::is_elastic>)
                                           .is_state(StatePart::motor_qd)
                                           .slope_of(StatePart::motor_q)
                                           .reads(read_state)
                                           .derivative(state_derivative)
                                           .depends(nullptr, initially::velocity)
                                           .measures(quantity::angular_velocity)
                                           .says("Angular velocity of the motor of %");

constexpr Entry current_entry =
    output(Owner::joint, "current")
        .in(OutputGroup::actuator)
        .there_if(takes_voltage)
        .is_state(StatePart::current)
        .reads([](Values& at, const Variable& v) { return at.actuator(v.joint).current; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().actuator(actuator_index(of, v)).current.derivative;
        })
        .depends(at_point::accelerations, initially::accelerations)
        .measures(quantity::current)
        .says("Current of the motor of %");

constexpr Entry entries[] = {
    joint_torque_entry.there_if(ends_at_joint),
    joint_torque_entry.in(OutputGroup::actuator).there_if(actuator_with<&Actuator::acts>),
    motor_angle_entry,
    motor_velocity_entry,
    current_entry,
    output(Owner::joint, "saturated")
        .in(OutputGroup::actuator)
        .there_if(has_limits)
        .bounds(Bounds::not_negative)
        .reads([](Values& at, const Variable& v) { return at.actuator(v.joint).saturation; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().actuator(actuator_index(of, v)).saturation.derivative;
        })
        .depends(at_point::accelerations, initially::accelerations)
        .says("Part of the torque of % that its limits remove, 0 to 1"),
};

template <bool (Actuator::*exists)() const>
constexpr Entry number(const char* name) {
  return parameter(Owner::joint, name)
      .there_if(actuator_with<exists>)
      .bounds(Bounds::positive)
      .acts_on(acts::gain);
}

constexpr Entry parameter_entries[] = {
    number<&Actuator::is_elastic>("gear_stiffness")
        .sets(
            [](auto& at, const Variable& v) -> auto& { return actuator_at(at.actuators, v.link).stiffness; })
        .measures(quantity::torsional_stiffness, quantity::linear_stiffness)
        .says("Stiffness of the gear of %"),
    number<&Actuator::is_elastic>("gear_damping")
        .sets([](auto& at, const Variable& v) -> auto& { return actuator_at(at.actuators, v.link).damping; })
        .bounds(Bounds::not_negative)
        .measures(quantity::torsional_damping, quantity::linear_damping)
        .says("Damping of the gear of %"),
    number<&Actuator::has_backlash>("backlash")
        .sets([](auto& at, const Variable& v) -> auto& { return actuator_at(at.actuators, v.link).backlash; })
        .measures(quantity::angle, quantity::length)
        .says("Backlash of the gear of %"),
    number<&Actuator::has_backlash>("backlash_width")
        .sets([](auto& at, const Variable& v) -> auto& {
          return actuator_at(at.actuators, v.link).backlash_width;
        })
        .measures(quantity::angle, quantity::length)
        .says("Depth beyond the backlash at which the gear of % reaches full stiffness"),
    number<&Actuator::limits_torque>("torque_limit")
        .sets([](auto& at, const Variable& v) -> auto& {
          return actuator_at(at.actuators, v.link).torque_limit;
        })
        .measures(quantity::torque, quantity::force)
        .says("Maximum drive of %"),
    number<&Actuator::limits_torque>("torque_limit_width")
        .sets([](auto& at, const Variable& v) -> auto& {
          return actuator_at(at.actuators, v.link).torque_limit_width;
        })
        .measures(quantity::torque, quantity::force)
        .says("Width of the onset of the maximum drive of %"),
    number<&Actuator::limits_speed>("speed_limit")
        .sets([](auto& at, const Variable& v) -> auto& {
          return actuator_at(at.actuators, v.link).speed_limit;
        })
        .measures(quantity::angular_velocity, quantity::velocity)
        .says("Speed at which the drive of % ends"),
    number<&Actuator::limits_speed>("speed_limit_width")
        .sets([](auto& at, const Variable& v) -> auto& {
          return actuator_at(at.actuators, v.link).speed_limit_width;
        })
        .measures(quantity::angular_velocity, quantity::velocity)
        .says("Range of speed in which the drive of % decreases to 0"),
    number<&Actuator::lags>("time_constant")
        .sets([](auto& at, const Variable& v) -> auto& {
          return actuator_at(at.actuators, v.link).time_constant;
        })
        .measures(quantity::duration)
        .says("Time constant of the drive of %"),
    number<&Actuator::is_electric>("resistance")
        .sets(
            [](auto& at, const Variable& v) -> auto& { return actuator_at(at.actuators, v.link).resistance; })
        .measures(quantity::resistance)
        .says("Resistance of the motor of %"),
    number<&Actuator::has_inductance>("inductance")
        .sets(
            [](auto& at, const Variable& v) -> auto& { return actuator_at(at.actuators, v.link).inductance; })
        .measures(quantity::inductance)
        .says("Inductance of the motor of %"),
    number<&Actuator::is_electric>("torque_constant")
        .sets([](auto& at, const Variable& v) -> auto& {
          return actuator_at(at.actuators, v.link).torque_constant;
        })
        .measures(quantity::torque_constant)
        .says("Torque constant of the motor of %"),
};

constexpr Unit ampere_per_second{"A/s", 0, 0, -1, 0, nullptr, 1, 1};
constexpr Unit newton_metre_per_second{"N.m/s", 1, 2, -3, 0}, newton_per_second{"N/s", 1, 1, -3, 0};
constexpr Unit volt_per_second{"V/s", 1, 2, -4, 0, nullptr, 1, -1};

void explain_lag(const Model& model, const Variable& variable, Presentation& shown) {
  const Actuator* actuator = actuator_of(model, variable);
  if (!actuator || !actuator->is_electric()) return;
  shown.quantity = shown.quantity.name ? quantity::voltage : Quantity{&volt_per_second};
}

// States that are not outputs, and derivatives of states.
constexpr Entry state_entries[] = {
    motor_angle_entry.local(),
    motor_velocity_entry.local(),
    output(Owner::joint, "motor_qdd")
        .local()
        .there_if(actuator_with<&Actuator::is_elastic>)
        .slope_of(StatePart::motor_qd)
        .reads([](Values& at, const Variable& v) { return at.slope(v); }, Needs::slopes)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().actuator(actuator_index(of, v)).motor_qdd.derivative;
        })
        .depends(at_point::accelerations, initially::accelerations)
        .measures(quantity::angular_acceleration)
        .says("Angular acceleration of the motor of %"),
    current_entry.local().there_if(has_inductance),
    output(Owner::joint, "current_rate")
        .local()
        .there_if(has_inductance)
        .slope_of(StatePart::current)
        .reads([](Values& at, const Variable& v) { return at.slope(v); }, Needs::slopes)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().actuator(actuator_index(of, v)).current_rate.derivative;
        })
        .depends(at_point::accelerations, initially::accelerations)
        .measures({&ampere_per_second})
        .says("Time derivative of the current of the motor of %"),
    output(Owner::joint, "lagged")
        .local()
        .there_if(actuator_with<&Actuator::lags>)
        .is_state(StatePart::lagged)
        .reads(read_state)
        .derivative(state_derivative)
        .depends(nullptr, initially::accelerations)
        .measures(quantity::torque, quantity::force)
        .says("Input of the actuator of % behind its lag")
        .adapted(explain_lag),
    output(Owner::joint, "lagged_rate")
        .local()
        .there_if(actuator_with<&Actuator::lags>)
        .slope_of(StatePart::lagged)
        .reads([](Values& at, const Variable& v) { return at.slope(v); }, Needs::slopes)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().actuator(actuator_index(of, v)).lagged_rate.derivative;
        })
        .depends(at_point::accelerations, initially::accelerations)
        .measures({&newton_metre_per_second}, {&newton_per_second})
        .says("Time derivative of the input of the actuator of % behind its lag")
        .adapted(explain_lag),
};

}  // namespace

const RowGroup ActuatorStates::rows = rows_in<state_entries>;
const WordGroup ActuatorStates::words = words_in<state_entries>;
const RowGroup ActuatorVariables::rows = rows_in<entries>;
const WordGroup ActuatorVariables::words = words_in<entries>;
const RowGroup ActuatorParameterVariables::rows = rows_in<parameter_entries>;
const WordGroup ActuatorParameterVariables::words = words_in<parameter_entries>;

}  // namespace redysim
