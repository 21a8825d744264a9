#pragma once

#include <vector>

#include "dynamics/workspace.hpp"

namespace redysim {

// Loads on wrist sensors: force and moment that the bodies outboard of a fixed link exert on the link's
// parent. A Plan merges fixed links into their carriers; this class has its own plan, in which each fixed
// link with a sensor is a body on a locked joint. Neither throws nor allocates after construction.
template <class Scalar>
class SensedWrenches {
 public:
  static bool needed(const Model& model);
  // `plan`: of `model`. Call `update` before the first evaluation.
  SensedWrenches(const Model& model, const Plan<double>& plan);
  void update(const Parameters<Scalar>& parameters) { plan_.update(parameters); }

  // Uses q, qd, qdd of all joints of the plan, moments and forces of its ports, and multipliers of its rows.
  void evaluate(const Scalar* q, const Scalar* qd, const Scalar* qdd, const Scalar* ports,
                const std::vector<Scalar>& lambda);

  // The wrench at the origin and in the axes of a frame with a wrench output.
  Force<Scalar> of(const Frame& frame) const;

 private:
  SensedWrenches(Plan<double>&& cut, const Plan<double>& plan);

  std::vector<int> joint_, row_, port_;  // per entry of plan_: index in the given plan; -1: none
  Plan<Scalar> plan_;
  Workspace<Scalar> workspace_;
  std::vector<Scalar> q_, qd_, qdd_, tau_, ports_, lambda_;
};

}  // namespace redysim
