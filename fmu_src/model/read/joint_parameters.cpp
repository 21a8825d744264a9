#include "model/read/joint_parameters.hpp"

#include <cmath>

#include "math/angles.hpp"
#include "model/number.hpp"

namespace redysim {
namespace {

double unit_of(const JointParameter& parameter, const Joint& joint, bool degrees) {
  const bool angle = turns(joint) && parameter.kind != JointParameter::Kind::other;
  return degrees && angle ? degree : 1;
}

void set_defaults(Joint& joint) {
  if (!turns(joint)) joint.stop_width = 1e-3;
}

void check_friction(Section& section, const Joint& joint, const std::string& of) {
  if (section.has("static_friction") && joint.static_friction < joint.friction)
    section.error("static_friction", "static_friction" + of + " must be >= friction, " +
                                         shown(joint.friction) + ", got " + shown(joint.static_friction));
  const bool has_friction = section.has("friction") || section.has("static_friction");
  if (!has_friction) section.warn_idle("friction_velocity", "without friction");
  if (joint.drive != Drive::locked) return;
  for (const char* key : {"armature", "damping", "friction", "static_friction"})
    section.warn_idle(key, "on a locked joint");
}

void check_stops(Section& section, const Joint& joint, const std::string& of) {
  if (!(joint.lower < joint.upper)) {
    section.error("upper", "upper" + of + " must be greater than lower");
    return;
  }
  const bool stops = section.has("lower") || section.has("upper");
  if (stops && !section.has("stop_stiffness"))
    section.error(section.has("lower") ? "lower" : "upper", "stop_stiffness is required with a stop");
  for (const char* key : {"stop_stiffness", "stop_damping", "stop_width"})
    if (!stops) section.warn_idle(key, "without lower or upper");
  for (const auto& [beyond, key] :
       {std::pair(joint.q0 < joint.lower, "lower"), std::pair(joint.q0 > joint.upper, "upper")})
    if (beyond) section.warn(section.has("q") ? "q" : key, "q" + of + " starts beyond the stop at " + key);
}

}  // namespace

void read_joint_parameters(Section& section, Joint& joint, bool degrees) {
  set_defaults(joint);
  for (const JointParameter& parameter : joint_parameters) {
    const double number = section.number(parameter.name, joint.*parameter.value, parameter.bound);
    if (section.has(parameter.name)) joint.*parameter.value = number * unit_of(parameter, joint, degrees);
  }
  if (!moves(joint)) return;
  check_friction(section, joint, "");
  check_stops(section, joint, "");
}

void read_joint_parameters(Section& section, std::vector<Joint>& dofs, bool degrees) {
  for (Joint& joint : dofs) set_defaults(joint);
  for (const JointParameter& parameter : joint_parameters) {
    const std::string name = parameter.name;
    const bool stop = std::isinf(Joint().*parameter.value);
    std::vector<double> given;
    if (!section.numbers(name, given, stop)) continue;
    if (given.size() != dofs.size()) {
      section.error(name, name + " must be " + std::to_string(dofs.size()) + " numbers, got " +
                              std::to_string(given.size()));
      continue;
    }
    for (std::size_t k = 0; k < given.size(); ++k)
      if (section.within(name, given[k], parameter.bound))
        dofs[k].*parameter.value = given[k] * unit_of(parameter, dofs[k], degrees);
  }
  for (std::size_t k = 0; k < dofs.size(); ++k) {
    const std::string of = " of DOF " + std::to_string(k + 1);
    check_friction(section, dofs[k], of);
    check_stops(section, dofs[k], of);
  }
}

}  // namespace redysim
