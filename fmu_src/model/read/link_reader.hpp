#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/read/names.hpp"

namespace redysim {

// Joints of several degrees of freedom in a model file.
enum class CompoundType { universal, cylindrical, planar, spherical, free };

// A [[link]] as read, its parent still a name.
struct LinkDraft {
  Link link;
  std::string parent;  // empty: the link before, or ground for the first
  Section section;
  std::optional<CompoundType> compound;  // the joint, until it is replaced
  std::vector<Joint> dofs;  // type and parameters of each DOF of a compound joint, without its Ball
  Ball ball;                // its start values
};

// All [[link]] tables in file order. `degrees`: the file's angles are in degrees.
std::vector<LinkDraft> read_links(Section& top, bool degrees, Names& names, Findings& findings);

}  // namespace redysim
