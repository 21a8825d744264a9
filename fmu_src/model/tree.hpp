#pragma once

#include <vector>

#include "model/read/link_reader.hpp"

namespace redysim {

// Finds each link's parent and brings parents before children; links whose order is free keep the file's.
// Unknown parents and rings become findings, and such links hang on ground.
void arrange_tree(std::vector<LinkDraft>& drafts);

}  // namespace redysim
