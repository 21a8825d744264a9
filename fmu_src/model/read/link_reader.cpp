#include "model/read/link_reader.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "math/angles.hpp"
#include "model/read/compound_joint.hpp"
#include "model/read/joint_parameters.hpp"
#include "model/read/model_checks.hpp"

namespace redysim {
namespace {

double to_radians(double angle, bool degrees) { return degrees ? angle * pi / 180 : angle; }

// Warns if a constant angle in radians exceeds a full turn (probably degrees), or if an angle in degrees is a
// multiple of pi/2 to 5 digits (probably radians).
double read_angle(Section& section, const char* key, bool degrees) {
  const double angle = section.number(key, 0);
  const auto text = [&] { return std::string(key) + " = " + shown(angle); };
  const double turns = std::abs(angle) / (2 * pi), quarters = 4 * turns;
  if (!degrees && turns > 1 + 1e-9)
    section.warn(key, text() + " rad is more than a full turn; for degrees set angle_unit = \"deg\"");
  if (degrees && std::abs(quarters - std::round(quarters)) < 1e-5 && std::round(quarters) > 0 && turns < 1.1)
    section.warn(key, text() + " deg is a multiple of pi/2; for radians set angle_unit = \"rad\"");
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

// In m/rad, also if angles are in degrees.
double read_pitch(Section& section, JointType type) {
  const double pitch = section.number("pitch", 1);
  if (type != JointType::screw) {
    if (section.has("pitch")) section.error("pitch", "pitch applies to a screw joint only");
    return 0;
  }
  if (!section.has("pitch")) section.error("pitch", "pitch is required for a screw joint");
  if (pitch == 0) section.error("pitch", "pitch must not be 0; use joint 'revolute'");
  return pitch;
}

void warn_without_effect(Section& section) {
  std::vector<std::string> keys = {"hold", "drive"};
  for (const JointParameter& parameter : joint_parameters) keys.push_back(parameter.name);
  for (const std::string& key : keys) section.warn_idle(key, "on a fixed joint");
}

using JointWord = std::tuple<JointType, std::optional<CompoundType>>;

std::vector<std::pair<const char*, JointWord>> joint_words() {
  std::vector<std::pair<const char*, JointWord>> words;
  for (const auto& [word, type] : joint_types) words.push_back({word, {type, {}}});
  for (const auto& [word, compound] : compound_types) words.push_back({word, {JointType::fixed, compound}});
  return words;
}

Joint read_joint(Section& section, const std::string& link_name, bool degrees,
                 std::optional<CompoundType>& compound) {
  Joint joint;
  std::tie(joint.type, compound) = section.choice<JointWord>("joint", joint_words(), {});
  joint.name = section.identifier("joint_name", link_name);
  joint.drive = section.choice<Drive>("drive",
                                      {{"torque", Drive::torque},
                                       {"free", Drive::free},
                                       {"motion", Drive::motion},
                                       {"locked", Drive::locked}},
                                      Drive::torque);
  joint.dh = read_dh(section, degrees);
  joint.pitch = read_pitch(section, joint.type);
  joint.hold = section.flag("hold", false);
  if (compound) return joint;
  read_joint_parameters(section, joint, degrees);
  if (!moves(joint)) warn_without_effect(section);
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
  const std::string parent = section.text("parent", "ground");
  std::optional<CompoundType> compound;
  link.joint = read_joint(section, link.name, degrees, compound);
  if (link.joint.name != link.name)
    names.claim(link.joint.name, "joint_name", "the joint of " + label, section);
  link.mass = section.number("mass", 0, Bound::not_negative);
  link.com = section.vector("com", link.com);
  link.inertia = read_inertia(section);
  link.line = section.place().line;
  link.column = section.place().column;
  LinkDraft draft{link, parent, section, compound, {}, {}};
  if (compound) read_compound(draft, degrees);
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
