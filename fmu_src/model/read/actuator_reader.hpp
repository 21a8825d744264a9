#pragma once

#include <vector>

#include "model/model.hpp"
#include "model/read/findings.hpp"
#include "model/read/section.hpp"

// [[actuator]] tables.

namespace redysim {

// Requires the links and spherical joints of `model`. `inverse`: prescribed joints may have an actuator.
std::vector<Actuator> read_actuators(Section& top, const Model& model, bool inverse, Findings& findings);

// Refuses a controller whose torque would be the voltage of a motor.
void check_controlled_actuators(Section& top, const Model& model, Findings& findings);

}  // namespace redysim
