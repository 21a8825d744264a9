#pragma once

#include <vector>

#include "model/model.hpp"
#include "model/read/findings.hpp"
#include "model/read/section.hpp"

// [[actuator]] tables.

namespace redysim {

// A parameter of an actuator that can be tunable as "<joint>.<name>", and whether an actuator has it.
struct ActuatorNumber {
  const char* name;
  bool (Actuator::*there)() const;
};
inline constexpr ActuatorNumber actuator_numbers[] = {
    {"gear_stiffness", &Actuator::is_elastic},  {"gear_damping", &Actuator::is_elastic},
    {"backlash", &Actuator::has_backlash},      {"backlash_width", &Actuator::has_backlash},
    {"torque_limit", &Actuator::limits_torque}, {"torque_limit_width", &Actuator::limits_torque},
    {"speed_limit", &Actuator::limits_speed},   {"speed_limit_width", &Actuator::limits_speed},
    {"time_constant", &Actuator::lags},         {"resistance", &Actuator::is_electric},
    {"inductance", &Actuator::has_inductance},  {"torque_constant", &Actuator::is_electric}};

// Reads the [[actuator]] tables; `model` must contain its links. `inverse`: prescribed joints may have one.
std::vector<Actuator> read_actuators(Section& top, const Model& model, bool inverse, Findings& findings);

// Reports a controller that computes torques for a joint whose motor takes a voltage.
void check_controlled_actuators(Section& top, const Model& model, Findings& findings);

}  // namespace redysim
