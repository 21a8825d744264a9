#include "model/read/link_reader.hpp"

#include <algorithm>
#include <cmath>

#include "model/read/compound_joint.hpp"
#include "model/read/joint_parameters.hpp"
#include "model/read/model_checks.hpp"

namespace redysim {
namespace {

constexpr double pi = 3.14159265358979323846;

double to_radians(double angle, bool degrees) { return degrees ? angle * pi / 180 : angle; }

// A constant angle beyond a full turn is one in degrees; one that is pi/2 to 5 digits, or a multiple, is one
// in radians.
double read_angle(Section& section, const char* key, bool degrees) {
  const double angle = section.number(key, 0);
  const std::string text = std::string(key) + " = " + shown(angle);
  const double turns = std::abs(angle) / (2 * pi), quarters = 4 * turns;
  if (!degrees && turns > 1 + 1e-9)
    section.warn(key, text + " rad is more than a full turn; for degrees set angle_unit = \"deg\"");
  if (degrees && std::abs(quarters - std::round(quarters)) < 1e-5 && std::round(quarters) > 0 && turns < 1.1)
    section.warn(key, text + " deg is a multiple of pi/2; for radians set angle_unit = \"rad\"");
  return to_radians(angle, degrees);
}

DhParameters read_dh(Section& section, bool degrees) {
  DhParameters dh;
  dh.gamma = read_angle(section, "gamma", degrees);
  dh.b = section.number("b", 0);
  dh.alpha = read_angle(section, "alpha", degrees);
  dh.a = section.number("a", 0);
  dh.theta = read_angle(section, "theta", degrees);
  dh.d = section.number("d", 0);
  return dh;
}

void warn_without_effect(Section& section) {
  std::vector<std::string> keys = {"hold", "drive"};
  for (const JointParameter& parameter : joint_parameters) keys.push_back(parameter.name);
  for (const std::string& key : keys)
    if (section.has(key)) section.warn(key, key + " has no effect on a fixed joint");
}

Joint read_joint(Section& section, const std::string& link_name, bool degrees) {
  Joint joint;
  joint.type = section.choice<JointType>("joint",
                                         {{"revolute", JointType::revolute},
                                          {"prismatic", JointType::prismatic},
                                          {"fixed", JointType::fixed},
                                          {"universal", JointType::universal},
                                          {"cylindrical", JointType::cylindrical},
                                          {"planar", JointType::planar},
                                          {"spherical", JointType::spherical},
                                          {"free", JointType::free}},
                                         JointType::revolute);
  joint.name = section.identifier("joint_name", link_name);
  joint.drive = section.choice<Drive>("drive",
                                      {{"torque", Drive::torque},
                                       {"free", Drive::free},
                                       {"motion", Drive::motion},
                                       {"locked", Drive::locked}},
                                      Drive::torque);
  joint.dh = read_dh(section, degrees);
  joint.hold = section.flag("hold", false);
  if (is_compound(joint.type)) return joint;
  read_joint_parameters(section, joint, degrees);
  if (joint.type == JointType::fixed) warn_without_effect(section);
  return joint;
}

// [Ixx, Iyy, Izz] or [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]
std::array<double, 6> read_inertia(Section& section) {
  std::array<double, 6> inertia{};
  std::vector<double> numbers;
  if (!section.numbers("inertia", numbers)) return inertia;
  if (numbers.size() == 3 || numbers.size() == 6)
    std::copy(numbers.begin(), numbers.end(), inertia.begin());
  else
    section.error("inertia", "inertia must be 3 or 6 numbers, got " + std::to_string(numbers.size()));
  return inertia;
}

LinkDraft read_link(Section section, const std::string& label, bool degrees, Names& names) {
  Link link;
  link.name = names.take(section, label);
  const std::string parent = section.text("parent");
  link.joint = read_joint(section, link.name, degrees);
  if (link.joint.name != link.name)
    names.claim(link.joint.name, "joint_name", "the joint of " + label, section);
  link.mass = section.number("mass", 0, Bound::not_negative);
  link.com = section.vector("com", link.com);
  link.inertia = read_inertia(section);
  link.line = section.place().line;
  link.column = section.place().column;
  LinkDraft draft{link, parent, section, {}, {}};
  if (is_compound(link.joint.type)) read_compound(draft, degrees);
  draft.section.refuse_unknown();
  check_inertia(link, draft.section);
  return draft;
}

}  // namespace

std::vector<LinkDraft> read_links(Section& top, bool degrees, Names& names, Findings& findings) {
  std::vector<LinkDraft> drafts;
  const std::size_t errors_before = findings.error_count();
  for (const Value* table : top.tables("link")) {
    const std::string label = label_of("link", drafts.size() + 1, *table);
    drafts.push_back(read_link(Section(*table, label, findings), label, degrees, names));
  }
  if (drafts.empty() && findings.error_count() == errors_before)
    top.error("link", "a model needs at least one [[link]]");
  return drafts;
}

}  // namespace redysim
