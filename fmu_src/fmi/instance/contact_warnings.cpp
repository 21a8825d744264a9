#include "fmi/instance/contact_warnings.hpp"

#include <algorithm>
#include <limits>

#include "dynamics/contact/contact_force.hpp"
#include "model/number.hpp"

namespace redysim {
namespace {

constexpr double hurled = 1000;  // acceleration limit of the lighter mechanism, m/s^2

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
  }
  return warnings;
}

}  // namespace redysim
