#pragma once

#include <utility>
#include <vector>

#include "model/read/link_reader.hpp"

// Joints with several DOF, built from revolute and prismatic joints on massless links. The carried link is
// fixed to the last one, so its own frame is the DH frame at rest. The state of a spherical part is a
// quaternion (Ball). Its three joints turn about z, x and y of the link (ReDySim's order), after a fourth
// joint that the simulation sets to 0 or 90 deg to avoid singular angles.

namespace redysim {

// Their words, in the field `joint`.
inline constexpr std::pair<const char*, CompoundType> compound_types[] = {
    {"universal", CompoundType::universal},
    {"cylindrical", CompoundType::cylindrical},
    {"planar", CompoundType::planar},
    {"spherical", CompoundType::spherical},
    {"free", CompoundType::free}};

// Whether its last degrees of freedom are a Ball.
bool has_ball(CompoundType type);

// Reads q, qd and the parameters of each DOF of the draft's compound joint.
void read_compound(LinkDraft& draft, bool degrees);

// Replaces compound joints in parent-sorted drafts; returns the balls, by link index.
std::vector<Ball> expand_compound_joints(std::vector<LinkDraft>& drafts);

}  // namespace redysim
