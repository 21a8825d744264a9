#pragma once

#include <vector>

#include "model/model.hpp"
#include "model/read/link_reader.hpp"

// Joints of several freedoms, built from revolute and prismatic joints on massless links. The carried link
// is fixed to the last of them, so its own frame is the DH frame at rest. Spherical parts keep a quaternion
// as state (Ball); their three joints turn about z, x and y of the link (ReDySim's order), after a fourth
// that the simulation sets to 0 or 90 deg to stay away from the singular angles.

namespace redysim {

bool is_compound(JointType type);

// Reads q, qd and per-freedom parameters of a compound joint into the draft.
void read_compound(LinkDraft& draft, bool degrees);

// Replaces compound joints in parent-sorted drafts; returns the balls, by link index.
std::vector<Ball> expand_compound_joints(std::vector<LinkDraft>& drafts);

}  // namespace redysim
