#pragma once

#include <string>

#include "fmi/variables/dependencies.hpp"
#include "fmi/variables/units.hpp"
#include "fmi/variables/variables.hpp"

// Unit, quantity and description of a variable. Used by `describe` only.

namespace redysim {

struct Presentation {
  Quantity quantity;
  std::string description;
};

// The part of an entry for the XML. Quantities and texts exist for turning and for sliding joints. In a text
//   %  is replaced by the owner, for example joint 'elbow',
//   $  by the label of the element, & by that of its matrix row.
struct Words {
  Quantity turning, sliding;
  const char* turning_text = "";
  const char* sliding_text = "";
  const char* const* labels = nullptr;
  int label_count = 1;
  void (*adapt)(const Model&, const Variable&, Presentation&) = nullptr;  // depends on the model

  double (*start)(const Model&, const Variable&) = nullptr;  // of an input; null: 0
  Rule at_point = nullptr, at_start = nullptr;               // dependencies of an output; null: none
  ConstantFactor constant = ConstantFactor::no;
};

// Names of the velocities of the tree (dynamics/equation_terms.hpp), and of its positions, with quaternions
// for spherical joints.
struct TreeCoordinate {
  std::string name;
  bool slides = false, is_quaternion = false;
};
std::vector<TreeCoordinate> tree_velocities(const Model& model);
std::vector<TreeCoordinate> tree_positions(const Model& model);

Presentation presentation(const Model& model, const Variable& variable);
const Words& words_of(const Variable& variable);

inline constexpr const char* axes[] = {"x", "y", "z"};
inline constexpr const char* quaternion_components[] = {"w", "x", "y", "z"};

}  // namespace redysim
