#pragma once

#include <vector>

#include "model/read/link_reader.hpp"

namespace redysim {

// Refuses an inertia with a negative principal moment; warns if it is not physically possible.
void check_inertia(const Link& link, Section& section);

// For each link the link it is rigidly connected to that is nearest to ground (itself under a moving
// joint, `ground` when nothing moves it). Requires parents before children.
std::vector<int> rigid_carriers(const std::vector<LinkDraft>& drafts);

// Refuses joints that move no inertia, for which no acceleration would be defined.
// Refuses a model without a moving joint, too.
void check_movable(std::vector<LinkDraft>& drafts, Section& top);

}  // namespace redysim
