#pragma once

#include <functional>
#include <string>
#include <vector>

#include "math/tape.hpp"

// Nodes of a tape as C++ code.

namespace redysim {

// "name[index]".
std::string indexed(const char* name, std::size_t index);

// A node as an operand: a number, the name of its symbol, or the name of the variable that holds it.
std::string operand(const Tape& tape, int node);

// Right-hand side of an arithmetic operation.
std::string arithmetic(const Tape& tape, int node);

// Statements that compute the nodes required by `results`, in this order as far as operands allow.
// `after(node)` is appended to each symbol or variable.
std::string value_statements(const Tape& tape, const std::vector<int>& results, const std::vector<int>& order,
                             const std::function<std::string(int)>& after);

}  // namespace redysim
