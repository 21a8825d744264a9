#include "fmi/instance/travel.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/motion_subspace.hpp"
#include "model/number.hpp"

namespace redysim {

static const JointPlan<double>& joint_at(const Simulation& simulation, int place) {
  return simulation.plan.joints[simulation.system.joint_of(place)];
}

void Travel::begin(const Simulation& simulation) {
  const double* y = simulation.integrator->state();
  ranges_.clear();
  has_begun_ = true;
  for (int k = 0; k < simulation.system.simple(); ++k)
    if (!turns(joint_at(simulation, k))) ranges_.push_back({k, y[k], 0});
}

void Travel::note(const Simulation& simulation) {
  if (!has_begun_) begin(simulation);  // for an instance that started with a saved state
  if (ranges_.empty()) return;
  const double* y = simulation.integrator->state();
  for (Range& range : ranges_)
    range.farthest = std::max(range.farthest, std::abs(y[range.place] - range.start));
}

std::vector<std::string> Travel::unresolved(const Simulation& simulation) const {
  constexpr double resolved = 100, rounding = 1e-6, rounding_of_largest = 1e-9;
  double largest = 0;
  for (const Range& range : ranges_) largest = std::max(largest, range.farthest);
  std::vector<std::string> sentences;
  for (const auto& [place, start, farthest] : ranges_) {
    const double tolerance = simulation.integrator_settings.rtol * std::abs(start) +
                             simulation.integrator_settings.atol * simulation.system.scales()[place];
    if (farthest > resolved * tolerance) continue;
    if (farthest < std::max(rounding * tolerance, rounding_of_largest * largest)) continue;
    const std::string& joint = simulation.model.links[joint_at(simulation, place).link].joint.name;
    sentences.push_back("joint '" + joint + "' moved by " + rounded(farthest) +
                        " m at most, and the solver's tolerance is " + rounded(tolerance) +
                        " m: lower solver.rtol and solver.atol to resolve this motion");
  }
  return sentences;
}

}  // namespace redysim
