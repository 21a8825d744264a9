#pragma once

#include <functional>
#include <string>
#include <vector>

#include "math/tape.hpp"

// Nodes of a tape as C++.

namespace redysim {

// NAME[INDEX].
std::string indexed(const char* name, std::size_t index);

// A node as an operand: a number, the name of its symbol, or that of the variable which holds it.
std::string operand(const Tape& tape, int node);

// The right-hand side of an arithmetic operation.
std::string arithmetic(const Tape& tape, int node);

// Statements that compute the nodes which `results` need, `after(node)` behind each that is a symbol or a
// variable, in this order as far as operands allow.
std::string value_statements(const Tape& tape, const std::vector<int>& results, const std::vector<int>& order,
                             const std::function<std::string(int)>& after);

}  // namespace redysim
