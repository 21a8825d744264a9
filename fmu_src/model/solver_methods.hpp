#pragma once

#include <utility>

#include "model/model.hpp"

namespace redysim {

// The words of `solver.method`.
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

}  // namespace redysim
