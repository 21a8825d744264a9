#include "model/motion_scale.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace redysim {
namespace {

constexpr double largest = 1, smallest = 1e-15;  // m

struct Moved {
  double mass = 0, size = 0;  // kg, m
};

// Mass and size of the links that the joint of link `first` moves.
Moved moved_by(const Model& model, const Parameters<double>& parameters, int first) {
  Moved moved;
  std::vector<bool> carried(model.links.size(), false);
  for (std::size_t i = static_cast<std::size_t>(first); i < model.links.size(); ++i) {
    const Link& link = model.links[i];
    const DhParameters& dh = link.joint.dh;
    const bool own = static_cast<int>(i) == first;
    if (!own && (link.parent == ground || !carried[static_cast<std::size_t>(link.parent)])) continue;
    carried[i] = true;
    // distance of the link from its parent
    if (!own) moved.size = std::max({moved.size, std::fabs(dh.a), std::fabs(dh.b), std::fabs(dh.d)});
    const auto& [mass, com, inertia] = parameters.links[i];
    if (!(mass > 0)) continue;
    moved.mass += mass;
    const double radius = std::sqrt((inertia[0] + inertia[1] + inertia[2]) / (2 * mass));
    moved.size = std::max({moved.size, com.norm(), radius});
  }
  return moved;
}

}  // namespace

double motion_scale(const Model& model, const Parameters<double>& parameters, int link) {
  if (turns(model.links[static_cast<std::size_t>(link)].joint)) return 1;
  const JointParameters<double>& joint = parameters.joints[static_cast<std::size_t>(link)];
  const Moved moved = moved_by(model, parameters, link);
  double scale = 0;
  // amplitude of the start motion on the spring, else distance of the stops, else size of the moved links
  if (joint.stiffness > 0)
    scale = std::max({std::fabs(joint.q0), std::fabs(joint.q0 - joint.rest),
                      std::fabs(joint.qd0) * std::sqrt((moved.mass + joint.armature) / joint.stiffness)});
  if (!(scale > 0) && std::isfinite(joint.upper - joint.lower)) scale = joint.upper - joint.lower;
  if (!(scale > 0)) scale = moved.size;
  return scale > 0 ? std::clamp(scale, smallest, largest) : largest;
}

double search_scale(const Model& model, const Parameters<double>& parameters, int link) {
  const double scale = motion_scale(model, parameters, link);
  if (turns(model.links[static_cast<std::size_t>(link)].joint)) return scale;
  return std::max(scale, moved_by(model, parameters, link).size);
}

}  // namespace redysim
