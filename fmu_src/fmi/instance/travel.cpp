#include "fmi/instance/travel.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/motion_subspace.hpp"
#include "model/number.hpp"

namespace redysim {

void Travel::begin(const Simulation& simulation) {
  const double* y = simulation.integrator->state();
  ranges_.clear();
  for (int k = 0; k < simulation.system.simple(); ++k) ranges_.push_back({y[k], 0});
}

void Travel::note(const Simulation& simulation) {
  const double* y = simulation.integrator->state();
  if (ranges_.empty()) begin(simulation);
  for (std::size_t k = 0; k < ranges_.size(); ++k)
    ranges_[k].farthest = std::max(ranges_[k].farthest, std::abs(y[k] - ranges_[k].start));
}

std::vector<std::string> Travel::unresolved(const Simulation& simulation) const {
  constexpr double resolved = 100, rounding = 1e-6, rounding_of_largest = 1e-9;
  const auto joint_of = [&](std::size_t k) -> const JointPlan<double>& {
    return simulation.plan.joints[simulation.system.joint_of(static_cast<int>(k))];
  };
  double largest = 0;  // of a sliding joint
  for (std::size_t k = 0; k < ranges_.size(); ++k)
    if (!turns(joint_of(k))) largest = std::max(largest, ranges_[k].farthest);
  std::vector<std::string> sentences;
  for (std::size_t k = 0; k < ranges_.size(); ++k) {
    const JointPlan<double>& joint = joint_of(k);
    const auto [start, farthest] = ranges_[k];
    const double tolerance = simulation.integrator_settings.rtol * std::abs(start) +
                             simulation.integrator_settings.atol * simulation.system.scales()[k];
    if (turns(joint) || farthest > resolved * tolerance) continue;
    if (farthest < std::max(rounding * tolerance, rounding_of_largest * largest)) continue;
    sentences.push_back("joint '" + simulation.model.links[joint.link].joint.name + "' moved by " +
                        rounded(farthest) + " m at most, and the solver's tolerance is " +
                        rounded(tolerance) + " m: lower solver.rtol and solver.atol to resolve this motion");
  }
  return sentences;
}

}  // namespace redysim
