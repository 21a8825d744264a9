#pragma once

#include "fmi/variables/variables.hpp"

// Conditions on the drive of a joint with one DOF, for its variables.

namespace redysim {

inline const Joint& joint_of(const Model& model, const Variable& variable) {
  return model.links[variable.link].joint;
}

inline const Actuator* actuator_of(const Model& model, const Variable& variable) {
  for (const Actuator& actuator : model.actuators)
    if (actuator.link == variable.link && actuator.acts()) return &actuator;
  return nullptr;
}

inline bool is_driven(const Scene& scene, const Variable& variable) {
  return joint_of(scene.model, variable).drive == Drive::torque;
}

template <bool (Actuator::*has)() const>
bool actuator_with(const Scene& scene, const Variable& variable) {
  const Actuator* actuator = actuator_of(scene.model, variable);
  return actuator && is_driven(scene, variable) && (actuator->*has)();
}

// Without a drive torque, the model ends at the joint: the input of its actuator is not computed.
inline bool ends_at_joint(const Scene& scene, const Variable& variable) {
  return !is_driven(scene, variable) && actuator_of(scene.model, variable);
}

inline bool takes_voltage(const Scene& scene, const Variable& variable) {
  return actuator_with<&Actuator::is_electric>(scene, variable);
}

// Whether the current of a motor is a state (actuator.cpp).
bool has_inductance(const Scene& scene, const Variable& variable);

// Whether the variable is a motion of a dependent joint: in a loop or rigid coupling and not prescribed. Then
// it is not a state. States of its motor are states.
inline bool is_dependent(const Scene& scene, const Variable& variable) {
  const Row& row = *variable.row;
  const StatePart part = row.state != StatePart::none ? row.state : row.slope_of;
  return part < StatePart::motor_q && !scene.plan.joints[variable.joint].prescribed &&
         scene.is_in_cluster(variable.joint);
}

inline bool is_algebraic(const Scene& scene, const Variable& variable) {
  return variable.row->state == StatePart::current && !has_inductance(scene, variable);
}

}  // namespace redysim
