#include "fmi/instance/contact_warnings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/contact/contact_force.hpp"
#include "dynamics/contact/touch.hpp"
#include "model/any_of.hpp"
#include "model/number.hpp"

namespace redysim {
namespace {

constexpr double hurled = 1000;  // acceleration limit of the lighter mechanism, m/s^2
constexpr double exact = 1e-6;   // relative to the size of a box

// Per body: mass of all bodies connected to it by joints and loops, kg.
std::vector<double> connected_masses(const Plan<double>& plan) {
  std::vector<int> group(plan.joints.size());
  for (std::size_t i = 0; i < group.size(); ++i)
    group[i] = plan.joints[i].parent == ground ? static_cast<int>(i) : group[plan.joints[i].parent];
  for (const auto& loop : plan.loops)
    if (loop.body_a != ground && loop.body_b != ground)
      std::replace(group.begin(), group.end(), int(group[loop.body_b]), int(group[loop.body_a]));
  std::vector<double> sums(group.size()), masses(group.size());
  for (std::size_t i = 0; i < group.size(); ++i) sums[group[i]] += plan.joints[i].inertia.mass;
  for (std::size_t i = 0; i < group.size(); ++i) masses[i] = sums[group[i]];
  return masses;
}

// Whether a corner is within `depth` of an edge of a box, or meets one of its corners: there the nearest face
// is not the one that must support it.
bool meets_an_edge(const ContactPair<double>& pair, const Workspace<double>& ws, double depth) {
  if (pair.surface.kind != ShapeKind::box || pair.spheres.size() == 1) return false;
  const RelativeMotion<double> motion = relative_motion(pair.surface, ground_state(ws, pair.sphere_entry),
                                                        ground_state(ws, pair.surface_entry));
  const double tolerance = std::max(depth, exact * pair.surface.half_size.maxCoeff());
  return any_of(pair.spheres, [&](const Vec3<double>& sphere) {
    const Vec3<double> p = motion.point(sphere);
    int outside = 0, at_edge = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double beyond = std::abs(p[axis]) - pair.surface.half_size[axis];
      outside += beyond > tolerance;
      at_edge += std::abs(beyond) <= tolerance;
    }
    return outside <= 1 && at_edge >= 2;
  });
}

}  // namespace

std::vector<ContactWarning> contact_warnings(const Model& model, const Plan<double>& plan,
                                             const Workspace<double>& ws) {
  std::vector<ContactWarning> warnings;
  const std::vector<double> masses = connected_masses(plan);
  for (std::size_t k = 0; k < model.contacts.size(); ++k) {
    const Contact& contact = model.contacts[k];
    const int index = static_cast<int>(k);
    const ContactResult<double> at = contact_result(plan, ws, index, contact.a.link);
    double mass = std::numeric_limits<double>::infinity();
    for (const int link : {contact.a.link, contact.b.link})
      if (link != ground && plan.carrier[link] != ground) mass = std::min(mass, masses[plan.carrier[link]]);
    if (at.force.norm() > hurled * mass)
      warnings.push_back({index, "contact '" + contact.name + "' starts " + rounded(at.depth) +
                                     " m deep, with a force of " + rounded(at.force.norm()) +
                                     " N: move the start pose, or set stiffness to the depth expected"});
    // twice the depth at which four corners support the weight, for a start without penetration
    const ContactLaw<double>& law = plan.contact_laws[k];
    const double depth =
        std::isfinite(mass) ? law.width + 0.5 * mass * plan.gravity.norm() / law.stiffness : law.width;
    if (any_of(plan.contact_pairs,
               [&](const auto& pair) { return pair.contact == index && meets_an_edge(pair, ws, depth); }))
      warnings.push_back(
          {index, "contact '" + contact.name + "': a corner meets an edge of a box within " + rounded(depth) +
                      " m, the depth expected: the bodies may pass through each other; give the corners a "
                      "radius, let one body overlap the other by more, or raise stiffness"});
  }
  return warnings;
}

}  // namespace redysim
