#pragma once

#include "dynamics/forces_between_bodies.hpp"
#include "dynamics/input_layout.hpp"
#include "dynamics/loops/coupling_rows.hpp"
#include "dynamics/loops/loop_elimination.hpp"

// Forward dynamics: the O(n) recursion that eliminates the joints from the leaves to the root (DeNOC: Saha
// 1997, reverse Gaussian elimination; the same as Featherstone 2008, Table 7.1). Closed loops are eliminated
// in the same pass.

namespace redysim {

// Root to leaves: velocities, inertias and bias wrenches of the bodies, including the wrenches of springs and
// ports, and the rows of loops. Uses positions.
template <class Scalar>
void set_bodies(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd,
                const Scalar* inputs) {
  set_motion(plan, ws, qd);
  if (plan.is_plain()) return;
  add_forces_between_bodies(plan, ws, q, qd);
  if (plan.has_ports()) add_port_wrenches(plan, ws, InputLayout(plan).port_wrench.of(inputs));
  if (!plan.has_constraints()) return;
  set_loop_rows(plan, ws);
  if (!plan.couplings.empty()) set_coupling_rows(plan, ws, inputs);
}

// Leaves to root: eliminates every joint into the articulated inertia of its parent. Uses positions.
template <class Scalar>
void eliminate_joints(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd,
                      const Scalar* inputs) {
  // first with fronts; if a row of a front may be dependent, again with whole clusters
  bool by_fronts = plan.has_fronts(), done = false;
  while (!done) {
    set_bodies(plan, ws, q, qd, inputs);
    done = plan.is_open() || eliminate_with_loops(plan, ws, q, qd, inputs, by_fronts);
    by_fronts = false;
  }
  if (!plan.is_open()) return;
  for (int i = static_cast<int>(plan.joints.size()) - 1; i >= 0; --i) eliminate(plan, ws, i, q, qd, inputs);
}

// Root to leaves: accelerations of the bodies, multipliers and qdd.
template <class Scalar>
void accelerate_joints(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* inputs, Scalar* qdd) {
  const int n = static_cast<int>(plan.joints.size());
  if (plan.is_open())
    for (int i = 0; i < n; ++i) accelerate_joint(plan, ws, i, qdd, Scalar(0));
  else
    accelerate_with_loops(plan, ws, qdd);
  if (plan.is_plain() || !plan.has_motion()) return;
  for (int i = 0; i < n; ++i)
    if (plan.joints[i].prescribed) qdd[i] = inputs[i];
}

// qdd (nv, rad/s^2 or m/s^2) from q, qd (nv) and the inputs (tau and port_wrench of InputLayout), with
// gravity, springs, dampers and closed loops. Fills the whole workspace. The result is not finite if the mass
// matrix is singular.
template <class Scalar>
void forward_dynamics(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd,
                      const Scalar* inputs, Scalar* qdd) {
  set_positions(plan, ws, q);
  eliminate_joints(plan, ws, q, qd, inputs);
  accelerate_joints(plan, ws, inputs, qdd);
}

}  // namespace redysim
