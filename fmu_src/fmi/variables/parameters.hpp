#pragma once

#include <string>

#include "fmi/variables/variables.hpp"

// Where the parameters that the FMU shows live in a model, and which values they take.

namespace redysim {

// What controls the joint of a link, or null.
const ControlledJoint* controlled_joint(const Model& model, int link);

// Where a Real parameter lives in a model; null for other variables.
double* parameter(Model& model, const Variable& variable);
double parameter(const Model& model, const Variable& variable);

// Legal texts of solver.method, and the method's text.
const char* method_name(SolverMethod method);
bool parse_method(const char* text, SolverMethod& method);
std::string method_names();  // 'erk', 'adams' or ...

// Why `value` may not be given to a Real variable, one sentence; empty if it may.
std::string objection(const Variable& variable, double value);

}  // namespace redysim
