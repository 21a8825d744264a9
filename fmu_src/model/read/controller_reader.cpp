#include "model/read/controller_reader.hpp"

#include <algorithm>

#include "math/angles.hpp"
#include "model/number.hpp"
#include "model/read/actuator_reader.hpp"
#include "model/read/joint_index.hpp"

namespace redysim {
namespace {

bool is_driven(const Model& model, std::size_t link, bool inverse) {
  const Joint& joint = model.links[link].joint;
  return moves(joint) && (joint.drive == Drive::torque || (inverse && joint.drive == Drive::motion));
}

// Reads the listed joints; without a list, all joints with drive torque.
std::vector<ControlledJoint> read_joints(Section& section, const Model& model, bool inverse) {
  std::vector<ControlledJoint> joints;
  const auto add = [&](int link) {
    joints.emplace_back();
    joints.back().link = link;
    joints.back().target = model.links[link].joint.q0;
  };
  if (!section.has("joints")) {
    for (std::size_t i = 0; i < model.links.size(); ++i)
      if (is_driven(model, i, inverse)) add(static_cast<int>(i));
    if (joints.empty()) section.error(section.place(), "no joint has drive 'torque'");
    return joints;
  }
  const JointIndex index(model);
  const std::size_t errors_before = section.error_count();
  for (const auto& [name, place] : section.texts("joints")) {
    const int link = index.find(name, "joints", place, section);
    if (link < 0) continue;
    if (!is_driven(model, static_cast<std::size_t>(link), inverse))
      section.error(place, "joints: the drive of '" + name + "' must be 'torque'");
    else if (has_part_of(joints, link))
      section.error(place, "joints lists '" + name + "' twice");
    else
      add(link);
  }
  if (joints.empty() && section.error_count() == errors_before)
    section.error("joints", "joints must not be empty");
  return joints;
}

// Reports a free joint without a reference, which feed-forward requires.
void check_feed_forward(Section& section, const Model& model, const Controller& controller) {
  if (model.has_constraints()) {
    section.error("law",
                  "feed_forward does not support loops and rigid couplings; use computed_torque or "
                  "gravity_compensation");
    return;
  }
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    const Joint& joint = model.links[i].joint;
    if (!moves(joint) || joint.drive == Drive::motion || joint.drive == Drive::locked) continue;
    if (has_part_of(controller.joints, static_cast<int>(i))) continue;
    section.error("law", "feed_forward requires a reference of every joint, but '" + joint.name +
                             "' is not controlled; use computed_torque");
    return;
  }
}

void read_targets(Section& section, const Model& model, bool degrees, Controller& controller) {
  if (!section.has("target")) return;
  const std::vector<double> targets = section.numbers_each("target", controller.joints.size(), 0);
  bool used = false;
  for (std::size_t k = 0; k < controller.joints.size(); ++k) {
    ControlledJoint& joint = controller.joints[k];
    joint.target = targets[k] * (degrees && turns(model.links[joint.link].joint) ? degree : 1);
    used = used || !has_part_of(model.trajectories, joint.link);
  }
  if (!used && !controller.joints.empty())
    section.warn("target", "target has no effect: all controlled joints follow trajectories");
}

void drop_tunable(Model& model, int link, const char* field) {
  std::vector<std::string>& tunable = model.fmu.tunable;
  const std::string name = model.links[link].joint.name + "." + field;
  tunable.erase(std::remove(tunable.begin(), tunable.end(), name), tunable.end());
}

void read_sampling(Section& section, Controller& controller) {
  constexpr double shortest = 1e-6;  // s
  constexpr int longest = 1000;      // maximum of delay / sample_time
  controller.sample_time = section.number("sample_time", 0, Bound::positive);
  controller.delay = section.number("delay", 0, Bound::not_negative);
  const bool sampled = controller.sample_time > 0;
  if (sampled && controller.sample_time < shortest)
    section.error("sample_time",
                  "sample_time must be >= " + shown(shortest) + " s, got " + shown(controller.sample_time));
  else if (section.has("delay") && !section.has("sample_time"))
    section.error("delay", "sample_time is required with delay");
  else if (sampled && controller.delay > longest * controller.sample_time)
    section.error("delay", "delay must be <= " + std::to_string(longest) + " sample_time, " +
                               shown(longest * controller.sample_time) + " s, got " +
                               shown(controller.delay));
}

}  // namespace

Controller read_controller(Section& top, const Model& model, bool degrees, bool inverse, Findings& findings) {
  Controller controller;
  const Value* table = top.table("controller");
  if (!table) return controller;
  Section section(*table, "controller", findings);
  section.require("law");
  controller.law = section.choice<Law>("law",
                                       {{"pd", Law::pd},
                                        {"gravity_compensation", Law::gravity_compensation},
                                        {"feed_forward", Law::feed_forward},
                                        {"computed_torque", Law::computed_torque}},
                                       Law::pd);
  controller.joints = read_joints(section, model, inverse);
  controller.input = section.flag("input", false);
  read_sampling(section, controller);
  const std::size_t count = controller.joints.size();
  for (const char* key : {"kp", "kd"}) {
    section.require(key);
    const std::vector<double> gains = section.numbers_each(key, count, 0, Bound::not_negative);
    for (std::size_t k = 0; k < count; ++k)
      (key[1] == 'p' ? controller.joints[k].kp : controller.joints[k].kd) = gains[k];
  }
  read_targets(section, model, degrees, controller);
  if (controller.law == Law::feed_forward) check_feed_forward(section, model, controller);
  section.refuse_unknown();
  return controller;
}

void check_trajectories(Section& top, const Model& model, Findings& findings) {
  std::size_t ordinal = 0;
  for (const Value* table : top.tables("trajectory")) {
    Section section(*table, "trajectory " + std::to_string(++ordinal), findings);
    const Value* name = table->find("joint");
    for (const Trajectory& trajectory : model.trajectories) {
      const Joint& joint = model.links[trajectory.link].joint;
      if (!name || name->text != joint.name || joint.drive == Drive::motion) continue;
      if (!has_part_of(model.controller.joints, trajectory.link))
        section.warn("joint", "the trajectory has no effect: the drive of joint '" + joint.name +
                                  "' is not 'motion' and no controller follows it");
    }
  }
}

void drop_drives(Model& model) {
  for (const ControlledJoint& controlled : model.controller.joints)
    for (const char* field : {"kp", "kd", "target"}) drop_tunable(model, controlled.link, field);
  model.controller = Controller();
  for (const Actuator& actuator : model.actuators)
    for (const ActuatorNumber& number : actuator_numbers) drop_tunable(model, actuator.link, number.name);
}

}  // namespace redysim
