#pragma once

#include "model/model.hpp"
#include "model/read/section.hpp"

namespace redysim {

// [controller]; `model` holds the links, loops, balls and trajectories. `inverse`: drives that were torques
// have become motions.
Controller read_controller(Section& top, const Model& model, bool degrees, bool inverse, Findings& findings);

// Warns of trajectories that nothing follows.
void check_trajectories(Section& top, const Model& model, Findings& findings);

// The inverse of a model takes motions where its controller and actuators gave torques: the controller goes,
// and the tunable numbers of both.
void drop_drives(Model& model);

}  // namespace redysim
