#pragma once

#include <string>

#include "fmi/variables/variables.hpp"

// Access to parameters and their legal values.

namespace redysim {

// The entry of a link's joint among the controlled ones, or null.
template <class ControlledJoints>
auto controlled_joint(ControlledJoints& joints, int link) -> decltype(joints.data()) {
  for (auto& joint : joints)
    if (joint.link == link) return &joint;
  return nullptr;
}

inline bool is_controlled(const Scene& scene, const Variable& variable) {
  return controlled_joint(scene.model.controller.joints, variable.link) != nullptr;
}

// The actuator of a link's joint; there is one.
template <class Actuators>
auto& actuator_at(Actuators& actuators, int link) {
  std::size_t k = 0;
  while (actuators[k].link != link) ++k;
  return actuators[k];
}

// The place of a Real parameter; null for other variables.
inline double* parameter(Parameters<double>& parameters, const Variable& variable) {
  return variable.row->storage == Storage::parameter
             ? variable.group->place(variable.row_index(), parameters, variable)
             : nullptr;
}

std::string method_names();  // legal texts of solver.method: 'erk', 'adams' or ...

// Why `value` is not legal for a Real variable; empty if it is.
std::string objection(const Variable& variable, double value);

}  // namespace redysim
