#include "fmi/variables/parameters.hpp"

#include <cmath>
#include <vector>

#include "model/number.hpp"
#include "model/read/suggest.hpp"
#include "model/solver_methods.hpp"

namespace redysim {

std::string method_names() {
  std::vector<std::string> names;
  for (const auto& [legal, value] : solver_methods) names.push_back(legal);
  return one_of(names);
}

std::string objection(const Variable& variable, double value) {
  if (!std::isfinite(value)) return variable.name + " must be a finite number, got " + shown(value);
  const std::string why = below(variable.min(), value);
  if (!why.empty()) return variable.name + " " + why;
  if (value > variable.max())
    return variable.name + " must be <= " + shown(variable.max()) + ", got " + shown(value);
  return {};
}

}  // namespace redysim
