#pragma once

#include <vector>

#include "model/read/link_reader.hpp"

namespace redysim {

// Resolves each link's parent and sorts parents before children, otherwise in the order of the file. Unknown
// parents and cycles are findings; the parent of such a link becomes the ground.
void arrange_tree(std::vector<LinkDraft>& drafts);

}  // namespace redysim
