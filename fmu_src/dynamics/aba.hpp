#pragma once

#include "dynamics/input_layout.hpp"
#include "dynamics/loops/loop_elimination.hpp"

// Forward dynamics: the O(n) recursion that eliminates one joint after the other from the leaves (DeNOC:
// Saha 1997, reverse Gaussian elimination; the same as Featherstone 2008, Table 7.1), with closed loops
// eliminated on the way.

namespace redysim {

// Springs, ports and rows of loops. Uses positions and velocities.
template <class Scalar>
void add_what_acts(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* qd, const Scalar* inputs) {
  if (plan.has_poses()) set_ground_motion(plan, ws, qd);
  if (plan.has_springs()) add_spring_wrenches(plan, ws);
  if (plan.has_ports()) add_port_wrenches(plan, ws, InputLayout(plan).port_wrench.of(inputs));
  if (plan.has_loops()) set_loop_rows(plan, ws);
}

// qdd (nv, rad/s^2 or m/s^2) from q, qd (nv) and the inputs: tau and port_wrench of InputLayout. Gravity,
// springs, dampers and closed loops included. Fills all of the workspace. Non-finite where the tree is not
// movable.
template <class Scalar>
void forward_dynamics(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd,
                      const Scalar* inputs, Scalar* qdd) {
  const int n = static_cast<int>(plan.joints.size());
  set_positions(plan, ws, q);
  const bool plain = plan.is_plain();
  // by fronts where they will do, else once more with clusters as a whole
  for (bool early = plan.has_fronts(), done = false; !done; early = false) {
    set_motion(plan, ws, qd);
    if (!plain) add_what_acts(plan, ws, qd, inputs);
    done = plain || !plan.has_loops() || eliminate_with_loops(plan, ws, q, qd, inputs, early);
  }
  if (plain || !plan.has_loops()) {
    for (int i = n - 1; i >= 0; --i) eliminate(plan, ws, i, q, qd, inputs);
    for (int i = 0; i < n; ++i) accelerate_joint(plan, ws, i, qdd, Scalar(0));
  } else {
    accelerate_with_loops(plan, ws, qdd);
  }
  if (plain || !plan.has_motion()) return;
  for (int i = 0; i < n; ++i)
    if (plan.joints[i].prescribed) qdd[i] = inputs[i];
}

}  // namespace redysim
