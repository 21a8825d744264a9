#include "model/solver_methods.hpp"

#include <cstring>

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

}  // namespace redysim
