#pragma once

#include <vector>

#include "model/model.hpp"
#include "model/read/names.hpp"

namespace redysim {

// What loops and springs need to know of the links.
struct LinkTable {
  LinkIndex index;
  std::vector<int> carriers;       // rigid_carriers(); empty: unknown, do not check
  std::vector<std::string> names;  // by link index
};

std::vector<Loop> read_loops(Section& top, const LinkTable& links, Names& names, Findings& findings);
std::vector<SpringDamper> read_springs(Section& top, const LinkTable& links, Names& names,
                                       Findings& findings);

}  // namespace redysim
