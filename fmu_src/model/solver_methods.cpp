#include "model/solver_methods.hpp"

#include <cmath>
#include <cstring>

#include "model/number.hpp"

namespace redysim {

const char* method_name(SolverMethod method) {
  for (const auto& [text, value] : solver_methods)
    if (value == method) return text;
  return solver_methods[0].first;
}

bool parse_method(const char* text, SolverMethod& method) {
  for (const auto& [legal, value] : solver_methods)
    if (std::strcmp(legal, text) == 0) {
      method = value;
      return true;
    }
  return false;
}

std::string objection_to_max_rhs(const SolverSettings& settings) {
  if (!(settings.max_rhs > 0)) return {};
  if (settings.max_rhs != std::floor(settings.max_rhs))
    return "max_rhs must be a whole number, got " + shown(settings.max_rhs);
  if (settings.max_rhs < smallest_max_rhs)
    return "max_rhs must be 0 or at least " + std::to_string(smallest_max_rhs) + ", got " +
           shown(settings.max_rhs);
  if (settings.method == SolverMethod::automatic || settings.method == SolverMethod::erk) return {};
  return std::string("max_rhs requires the method 'auto' or 'erk', got '") + method_name(settings.method) +
         "'";
}

}  // namespace redysim
