#pragma once

#include "dynamics/loop_elimination.hpp"

// Forward dynamics: the O(n) recursion that eliminates one joint after the other from the leaves (DeNOC:
// Saha 1997, reverse Gaussian elimination; the same as Featherstone 2008, Table 7.1), with closed loops
// eliminated on the way.

namespace redysim {

// qdd (nv, rad/s^2 or m/s^2) from q, qd (nv) and the inputs: tau (nv, N m or N), then moment and force of
// each port (6 each). For a prescribed joint tau holds its acceleration. Gravity, springs, dampers and closed
// loops included. Fills all of the workspace. Non-finite where the tree is not movable.
template <class Scalar>
void forward_dynamics(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd,
                      const Scalar* inputs, Scalar* qdd) {
  const int n = static_cast<int>(plan.joints.size());
  set_positions(plan, ws, q);
  set_motion(plan, ws, qd);
  const bool plain = plan.is_plain();
  if (!plain) {
    if (plan.has_poses()) set_ground_motion(plan, ws, qd);
    if (plan.has_springs()) add_spring_wrenches(plan, ws);
    if (plan.has_ports()) add_port_wrenches(plan, ws, inputs + n);
  }
  if (plain || !plan.has_loops()) {
    for (int i = n - 1; i >= 0; --i) eliminate(plan, ws, i, q, qd, inputs);
    for (int i = 0; i < n; ++i) accelerate_joint(plan, ws, i, qdd, Scalar(0));
  } else {
    set_loop_rows(plan, ws);
    eliminate_with_loops(plan, ws, q, qd, inputs);
    accelerate_with_loops(plan, ws, qdd);
  }
  if (plain || !plan.has_motion()) return;
  for (int i = 0; i < n; ++i)
    if (plan.joints[i].prescribed) qdd[i] = inputs[i];
}

}  // namespace redysim
