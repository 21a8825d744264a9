#pragma once

#include <vector>

#include "model/read/link_reader.hpp"

namespace redysim {

// Resolves the parent of each link and sorts the links parents first, otherwise in file order. Unknown
// parents and cycles are errors; such a link gets ground as its parent.
void arrange_tree(std::vector<LinkDraft>& drafts);

}  // namespace redysim
