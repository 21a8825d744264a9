#pragma once

#include <vector>

#include "fmi/variables/variables.hpp"

// The model structure of the XML: which variables an output depends on.

namespace redysim {

// Knowns by index into VariableTable::all(). `all`: every known, or too many to list; `knowns` is empty then.
// `constant`: each by a constant factor, not merely somehow.
struct Dependencies {
  int unknown = 0;
  bool all = false;
  std::vector<int> knowns;
  bool constant = false;
};

// At a communication point: what an input that changes there changes at once.
std::vector<Dependencies> output_dependencies(const VariableTable& table, const Plan<double>& plan);

// In initialization mode: on inputs, start values and tunable parameters.
std::vector<Dependencies> initial_dependencies(const VariableTable& table, const Plan<double>& plan);

}  // namespace redysim
