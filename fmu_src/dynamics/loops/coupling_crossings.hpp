#pragma once

#include <algorithm>
#include <map>
#include <utility>

#include "dynamics/plan.hpp"

// Crossings of couplings in clusters and fronts (`Part`).

namespace redysim {

inline RowCrossing coupling_crossing(const CouplingPlan& coupling, int joint) {
  RowCrossing crossing;
  crossing.row = coupling.row;
  crossing.loop = -1;
  const auto found = std::find(coupling.joints.begin(), coupling.joints.end(), joint);
  if (found != coupling.joints.end())
    crossing.ratio = coupling.ratios[static_cast<std::size_t>(found - coupling.joints.begin())];
  return crossing;
}

// Index into LoopState::coupling_wrench by row and joint.
using CouplingWrenches = std::map<std::pair<int, int>, int>;

template <class Part, class Visit>
void for_each_coupling_crossing(Part& part, Visit visit) {
  for (std::size_t k = 0; k < part.joints.size(); ++k)
    for (int n = part.crossing_begin[k]; n < part.crossing_begin[k + 1]; ++n)
      if (part.crossings[n].of_coupling()) visit(part.crossings[n], part.joints[k], part.first_crossing + n);
}

// Assigns a wrench to each crossing of a coupling, starting at index `first`.
template <class Part>
void add_wrenches(Part& part, int first, CouplingWrenches& wrenches) {
  for_each_coupling_crossing(part, [&](RowCrossing& crossing, int joint, int index) {
    crossing.wrench = first + index;
    wrenches[{crossing.row, joint}] = first + index;
  });
}

template <class Part, class Scalar>
void set_inboard_wrenches(Part& part, const Plan<Scalar>& plan, const CouplingWrenches& wrenches) {
  for_each_coupling_crossing(part, [&](RowCrossing& crossing, int joint, int) {
    const auto found = wrenches.find({crossing.row, plan.joints[joint].parent});
    if (found != wrenches.end()) crossing.inboard = found->second;
  });
}

}  // namespace redysim
