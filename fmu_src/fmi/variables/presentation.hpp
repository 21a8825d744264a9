#pragma once

#include <string>

#include "fmi/variables/variables.hpp"

// What a person reads about a variable: unit, quantity and a sentence. Used by `describe` alone.

namespace redysim {

// A unit by exponents of the SI base units, and the unit people prefer to see (null: this one).
struct Unit {
  const char* name;
  int kg, m, s, rad;
  const char* display_name = nullptr;
  double display_factor = 1;  // display value = factor * value
};

struct Presentation {
  const Unit* unit = nullptr;  // null: a pure number
  const char* quantity = nullptr;
  std::string description;
};

Presentation presentation(const Model& model, const Variable& variable);

}  // namespace redysim
