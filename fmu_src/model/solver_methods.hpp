#pragma once

#include <string>
#include <utility>

#include "model/model.hpp"

namespace redysim {

// Names of the methods in `solver.method`.
inline constexpr std::pair<const char*, SolverMethod> solver_methods[] = {
    {"erk", SolverMethod::erk},
    {"adams", SolverMethod::adams},
    {"dirk", SolverMethod::dirk},
    {"bdf", SolverMethod::bdf},
    {"exponential", SolverMethod::exponential},
    {"taylor", SolverMethod::taylor},
    {"auto", SolverMethod::automatic}};

const char* method_name(SolverMethod method);
bool parse_method(const char* text, SolverMethod& method);  // false: unknown

// Reason why this `max_rhs` is not possible, one sentence; empty if it is. The smallest possible value allows
// one step of order 5 and the evaluation that estimates the first step size.
inline constexpr int smallest_max_rhs = 8;
std::string objection_to_max_rhs(const SolverSettings& settings);

}  // namespace redysim
