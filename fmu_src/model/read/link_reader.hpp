#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/read/names.hpp"

namespace redysim {

// A [[link]] as read, its parent still a name.
struct LinkDraft {
  Link link;
  std::string parent;  // empty: the link before, or ground for the first
  Section section;
  std::vector<Joint> freedoms;  // of a compound joint, but for those of its ball: type and parameters
  Ball ball;                    // its start values
};

// All [[link]] tables in file order. `degrees`: the file's angles are in degrees.
std::vector<LinkDraft> read_links(Section& top, bool degrees, Names& names, Findings& findings);

}  // namespace redysim
