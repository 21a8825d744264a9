#pragma once

#include <string>

#include "fmi/variables/variables.hpp"

// Access to parameters and their legal values.

namespace redysim {

// The controller entry of the joint of a link, or null.
template <class SomeModel>
auto controlled_joint(SomeModel& model, int link) -> decltype(model.controller.joints.data()) {
  for (auto& joint : model.controller.joints)
    if (joint.link == link) return &joint;
  return nullptr;
}

// The place of a Real parameter in a model; null for other variables.
inline double* parameter(Model& model, const Variable& variable) {
  return variable.row->storage == Storage::parameter
             ? variable.group->place(variable.row_index, model, variable)
             : nullptr;
}

// Legal texts of solver.method, and the method's text.
const char* method_name(SolverMethod method);
bool parse_method(const char* text, SolverMethod& method);
std::string method_names();  // 'erk', 'adams' or ...

// "there is no Real variable with value reference 7"
std::string unknown_reference(unsigned reference, const char* type);

// Why `value` is not legal for a Real variable; empty if it is.
std::string objection(const Variable& variable, double value);

}  // namespace redysim
