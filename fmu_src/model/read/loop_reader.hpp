#pragma once

#include <vector>

#include "model/model.hpp"
#include "model/read/link_table.hpp"
#include "model/read/names.hpp"

namespace redysim {

std::vector<Loop> read_loops(Section& top, const LinkTable& links, Names& names, Findings& findings);
std::vector<SpringDamper> read_springs(Section& top, const LinkTable& links, Names& names,
                                       Findings& findings);
std::vector<Bushing> read_bushings(Section& top, const LinkTable& links, bool degrees, Names& names,
                                   Findings& findings);

}  // namespace redysim
