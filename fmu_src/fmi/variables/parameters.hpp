#pragma once

#include <string>

#include "fmi/variables/variables.hpp"

// Access to parameters and their legal values.

namespace redysim {

// The controlled joint of a link, or null.
template <class ControlledJoints>
auto controlled_joint(ControlledJoints& joints, int link) -> decltype(joints.data()) {
  for (auto& joint : joints)
    if (joint.link == link) return &joint;
  return nullptr;
}

inline bool is_controlled(const Scene& scene, const Variable& variable) {
  return controlled_joint(scene.model.controller.joints, variable.link) != nullptr;
}

// The actuator of a link's joint; it must exist.
template <class Actuators>
auto& actuator_at(Actuators& actuators, int link) {
  std::size_t k = 0;
  while (actuators[k].link != link) ++k;
  return actuators[k];
}

// Address of a Real parameter; null for other variables.
inline double* parameter(Parameters<double>& parameters, const Variable& variable) {
  return variable.row->storage == Storage::parameter
             ? variable.group->place(variable.row_index(), parameters, variable)
             : nullptr;
}

std::string method_names();  // valid texts of solver.method: 'erk', 'adams' or ...

// Why `value` is not valid for a Real variable; empty if it is.
std::string objection(const Variable& variable, double value);

}  // namespace redysim
