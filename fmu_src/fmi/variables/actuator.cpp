#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/drive.hpp"
#include "fmi/variables/entry.hpp"

// Outputs of the actuator of a joint. Its input: joint.cpp.

namespace redysim {
namespace {

bool has_limits(const Scene& scene, const Variable& variable) {
  return actuator_with<&Actuator::limits_torque>(scene, variable) ||
         actuator_with<&Actuator::limits_speed>(scene, variable);
}

int actuator_index(OutputDerivatives& of, const Variable& v) {
  return of.values().system().actuators()->at(v.joint);
}

constexpr Entry joint_torque_entry =
    output(Owner::joint, "tau_joint")
        .reads([](Values& at, const Variable& v) { return at.drive_force(v.joint); }, Needs::accelerations)
        .derivative(
            [](OutputDerivatives& of, const Variable& v) { return of.tangent().drive[v.joint].derivative; })
        .depends(at_point::accelerations, initially::accelerations)
        .measures(quantity::torque, quantity::force)
        .says("Torque of the actuator on %", "Force of the actuator on %");

constexpr Entry entries[] = {
    joint_torque_entry.there_if(ends_at_joint),
    joint_torque_entry.in(OutputGroup::actuator).there_if(actuator_with<&Actuator::acts>),
    output(Owner::joint, "motor_q")
        .in(OutputGroup::actuator)
        .there_if(actuator_with<&Actuator::is_elastic>)
        .reads([](Values& at, const Variable& v) { return at.motor(v.joint, false); })
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().motor_q(actuator_index(of, v)).derivative;
        })
        .rate_is_next()
        .depends(nullptr, initially::position)
        .measures(quantity::angle)
        .says("Angle of the motor of %"),
    output(Owner::joint, "motor_qd")
        .in(OutputGroup::actuator)
        .there_if(actuator_with<&Actuator::is_elastic>)
        .reads([](Values& at, const Variable& v) { return at.motor(v.joint, true); })
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().motor_qd(actuator_index(of, v)).derivative;
        })
        .depends(nullptr, initially::velocity)
        .measures(quantity::angular_velocity)
        .says("Angular velocity of the motor of %"),
    output(Owner::joint, "current")
        .in(OutputGroup::actuator)
        .there_if(takes_voltage)
        .reads([](Values& at, const Variable& v) { return at.actuator(v.joint).current; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().actuator(actuator_index(of, v)).current.derivative;
        })
        .depends(at_point::accelerations, initially::accelerations)
        .measures(quantity::current)
        .says("Current of the motor of %"),
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

}  // namespace

const RowGroup ActuatorVariables::rows = rows_in<entries>;
const WordGroup ActuatorVariables::words = words_in<entries>;

}  // namespace redysim
