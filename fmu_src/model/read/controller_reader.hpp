#pragma once

#include "model/model.hpp"
#include "model/read/section.hpp"

namespace redysim {

// Reads [controller]; `model` must contain links, loops, balls and trajectories. `inverse`: drives that were
// torques have become motions.
Controller read_controller(Section& top, const Model& model, bool degrees, bool inverse, Findings& findings);

// Warns about trajectories that no joint or controller uses.
void check_trajectories(Section& top, const Model& model, Findings& findings);

// Removes the controller and the tunable parameters of controller and actuators from an inverse model, in
// which their joints have prescribed motions.
void drop_drives(Model& model);

}  // namespace redysim
