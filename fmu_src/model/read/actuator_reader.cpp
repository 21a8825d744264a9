#include "model/read/actuator_reader.hpp"

#include "model/number.hpp"
#include "model/read/joint_index.hpp"

namespace redysim {
namespace {

constexpr double torque_width = 0.05, speed_width = 0.05, play_width = 0.1;  // relative to limit or backlash

// Link of the driven joint; -1 after reporting an error.
int read_joint(Section& section, const Model& model, bool inverse) {
  section.require("joint");
  const std::string name = section.text("joint");
  if (name.empty()) return -1;
  const int link = JointIndex(model).find(name, "joint", section.place("joint"), section);
  if (link < 0) return -1;
  const Drive drive = model.links[link].joint.drive;
  if (drive == Drive::torque || (inverse && drive == Drive::motion)) return link;
  section.error("joint", "the drive of joint '" + name + "' must be 'torque'");
  return -1;
}

void require(Section& section, const char* key, const char* with) {
  if (section.has(with) && !section.has(key))
    section.error(with, std::string(key) + " is required with " + with);
}

// An elastic gear's rotor is not part of the recursion; on a prismatic joint it would couple to the velocity.
void read_gyroscopic(Section& section, const Joint& joint, Actuator& actuator) {
  actuator.gyroscopic = section.flag("gyroscopic", false);
  require(section, "rotor_inertia", "gyroscopic");
  if (!actuator.gyroscopic) return;
  if (actuator.is_elastic())
    section.error("gyroscopic",
                  "gyroscopic is not supported with stiffness; model the rotor as a link, with a coupling");
  else if (joint.type == JointType::prismatic)
    section.error("gyroscopic", "gyroscopic requires a joint that turns; joint '" + joint.name + "' slides");
}

void read_gear(Section& section, const Joint& joint, Actuator& actuator) {
  actuator.gear_ratio = section.number("gear_ratio", 1);
  if (actuator.gear_ratio == 0) section.error("gear_ratio", "gear_ratio must not be 0");
  actuator.rotor_inertia = section.number("rotor_inertia", 0, Bound::not_negative);
  actuator.stiffness = section.number("stiffness", 0, Bound::positive);
  actuator.damping = section.number("damping", 0, Bound::not_negative);
  actuator.backlash = section.number("backlash", 0, Bound::positive);
  actuator.backlash_width = section.number("backlash_width", play_width * actuator.backlash, Bound::positive);
  read_gyroscopic(section, joint, actuator);
  require(section, "stiffness", "damping");
  require(section, "stiffness", "backlash");
  require(section, "backlash", "backlash_width");
  require(section, "rotor_inertia", "stiffness");
  if (section.has("stiffness") && section.has("rotor_inertia") && actuator.rotor_inertia == 0)
    section.error("rotor_inertia", "rotor_inertia must be > 0 with stiffness, got 0");
  if (section.has("rotor_inertia") && !section.has("stiffness") && joint.armature != 0)
    section.error("rotor_inertia", "rotor_inertia and the armature of joint '" + joint.name +
                                       "' must not both be given: armature = gear_ratio^2 rotor_inertia");
}

void read_limit(Section& section, const std::string& key, double part, double& limit, double& width) {
  limit = section.number(key, limit, Bound::positive);
  const std::string width_key = key + "_width";
  width = section.number(width_key, section.has(key) ? part * limit : 0, Bound::positive);
  require(section, key.c_str(), width_key.c_str());
  if (section.has(key) && width > limit)
    section.error(width_key,
                  width_key + " must be <= " + key + ", " + shown(limit) + ", got " + shown(width));
}

void read_motor(Section& section, Actuator& actuator) {
  actuator.resistance = section.number("resistance", 0, Bound::positive);
  actuator.inductance = section.number("inductance", 0, Bound::not_negative);
  actuator.torque_constant = section.number("torque_constant", 0, Bound::positive);
  require(section, "torque_constant", "resistance");
  require(section, "resistance", "torque_constant");
  require(section, "resistance", "inductance");
}

Actuator read_actuator(Section& section, const Model& model, bool inverse) {
  Actuator actuator;
  actuator.link = read_joint(section, model, inverse);
  read_gear(section, actuator.link < 0 ? Joint() : model.links[actuator.link].joint, actuator);
  read_limit(section, "torque_limit", torque_width, actuator.torque_limit, actuator.torque_limit_width);
  read_limit(section, "speed_limit", speed_width, actuator.speed_limit, actuator.speed_limit_width);
  actuator.time_constant = section.number("time_constant", 0, Bound::positive);
  read_motor(section, actuator);
  if (!section.has("rotor_inertia") && !actuator.is_electric())
    section.warn_idle("gear_ratio", "without rotor_inertia or a DC motor");
  section.refuse_unknown();
  return actuator;
}

}  // namespace

std::vector<Actuator> read_actuators(Section& top, const Model& model, bool inverse, Findings& findings) {
  std::vector<Actuator> actuators;
  std::size_t ordinal = 0;
  for (const Value* table : top.tables("actuator")) {
    Section section(*table, "actuator " + std::to_string(++ordinal), findings);
    const Actuator actuator = read_actuator(section, model, inverse);
    if (actuator.link < 0) continue;
    if (has_part_of(actuators, actuator.link))
      section.error("joint", "joint '" + section.text("joint") + "' already has an actuator");
    else
      actuators.push_back(actuator);
  }
  return actuators;
}

void check_controlled_actuators(Section& top, const Model& model, Findings& findings) {
  const Value* table = top.table("controller");
  const Law law = model.controller.law;
  if (!table || law == Law::none || law == Law::pd) return;
  Section section(*table, "controller", findings);
  for (const Actuator& actuator : model.actuators) {
    const bool all = law == Law::computed_torque;
    if (!actuator.is_electric() || !(all || has_part_of(model.controller.joints, actuator.link))) continue;
    section.error("law", (all ? "computed_torque needs the torques of all joints, but the actuator of joint '"
                              : "the law needs torques, but the actuator of joint '") +
                             model.links[actuator.link].joint.name + "' takes a voltage; use pd");
    return;
  }
}

}  // namespace redysim
