#pragma once

#include <vector>

#include "model/read/link_reader.hpp"

namespace redysim {

// Reports an inertia with a negative principal moment and warns if it is not physically possible.
void check_inertia(const Link& link, Section& section);

// For each link, the rigidly connected link that is nearest to ground: the link itself if its joint moves,
// `ground` if no joint moves it. Requires parents before children.
std::vector<int> rigid_carriers(const std::vector<LinkDraft>& drafts);

// Reports joints that move no inertia, because their acceleration would be undefined, and a model without
// moving joints.
void check_movable(std::vector<LinkDraft>& drafts, Section& top);

}  // namespace redysim
