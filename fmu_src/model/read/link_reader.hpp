#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/read/names.hpp"

namespace redysim {

// Joints with several degrees of freedom in a model file.
enum class CompoundType { universal, cylindrical, planar, spherical, free };

// A [[link]] table as read; its parent is still given by name.
struct LinkDraft {
  Link link;
  std::string parent;  // empty: the previous link, or ground for the first link
  Section section;
  std::optional<CompoundType> compound;  // type of a compound joint until it is expanded
  std::vector<Joint> dofs;               // type and parameters of each DOF without the Ball
  Ball ball;                             // start values of the Ball
};

// Reads all [[link]] tables in file order. `degrees`: angles in the file are in degrees.
std::vector<LinkDraft> read_links(Section& top, bool degrees, Names& names, Findings& findings);

}  // namespace redysim
