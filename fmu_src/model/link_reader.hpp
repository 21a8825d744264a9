#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/names.hpp"

namespace redysim {

// A [[link]] as read, its parent still a name.
struct LinkDraft {
  Link link;
  std::string parent;  // empty: the link before, or ground for the first
  Section section;
  // of a compound joint: start values and parameters per freedom
  std::vector<double> q, qd, damping, stiffness, rest, armature;
};

// All [[link]] tables in file order. `degrees`: the file's angles are in degrees.
std::vector<LinkDraft> read_links(Section& top, bool degrees, Names& names, Findings& findings);

}  // namespace redysim
