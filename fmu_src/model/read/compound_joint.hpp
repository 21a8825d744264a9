#pragma once

#include <utility>
#include <vector>

#include "model/read/link_reader.hpp"

// Joints with several DOF, built from revolute and prismatic joints on massless links. The link itself is
// fixed to the last of them, so at rest its frame is the DH frame. A spherical part has a quaternion as state
// (Ball); its last three joints are about z, x and y of the link (ReDySim's order), and the joint before them
// is set to 0 or 90 deg by the simulation to avoid singular angles.

namespace redysim {

// Names of the types in the field `joint`.
inline constexpr std::pair<const char*, CompoundType> compound_types[] = {
    {"universal", CompoundType::universal},
    {"cylindrical", CompoundType::cylindrical},
    {"planar", CompoundType::planar},
    {"spherical", CompoundType::spherical},
    {"free", CompoundType::free}};

// Whether the last degrees of freedom of the joint are spherical.
bool has_ball(CompoundType type);

// Reads q, qd and the parameters of each DOF of the draft's compound joint.
void read_compound(LinkDraft& draft, bool degrees);

// Replaces the compound joints of drafts sorted parents first. Returns the spherical joints by link index.
std::vector<Ball> expand_compound_joints(std::vector<LinkDraft>& drafts);

}  // namespace redysim
