#pragma once

#include "dynamics/loops/loop_elimination.hpp"

namespace redysim {

// Leaves to root, at rest: transmits the bias wrench over joint i with the joint force `force`.
template <class Scalar>
void propagate_force(const Plan<Scalar>& plan, Workspace<Scalar>& ws, int i, const Scalar& force) {
  const JointPlan<Scalar>& joint = plan.joints[i];
  JointState<Scalar>& s = ws.joints[i];
  s.u = force - generalized_force(joint, s.p);
  if (joint.parent == ground) return;
  const Scalar scaled = s.u * s.D_inverse;
  Force<Scalar> p{s.p.moment + s.U.moment * scaled, s.p.force + s.U.force * scaled};
  to_parent(joint, s, p);
  add(ws.joints[joint.parent].p, p);
}

// b <- b - u_r u / D for the rows that cross a joint: (5) at rest.
template <class Scalar>
void update_rows(const RowCrossing* begin, const RowCrossing* end, const Scalar* u,
                 const JointState<Scalar>& s, std::vector<Scalar>& b) {
  for (; begin != end; ++begin, ++u) b[begin->row] -= *u * s.u * s.D_inverse;
}

// Propagates over the joints of a cluster, then applies b of its rows to the bias wrench of the root.
template <class Scalar, class Propagate>
void propagate_cluster(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t c, Propagate propagate) {
  const ClusterPlan& cluster = plan.clusters[c];
  LoopState<Scalar>& state = ws.loop;
  for (std::size_t k = 0; k < cluster.joints.size(); ++k) {
    const int begin = cluster.crossing_begin[k], end = cluster.crossing_begin[k + 1];
    propagate(cluster.joints[k]);
    update_rows(cluster.crossings.data() + begin, cluster.crossings.data() + end,
                state.crossing_u.data() + cluster.first_crossing + begin, ws.joints[cluster.joints[k]],
                state.b);
  }
  if (cluster.root == ground) return;
  const int first = cluster.first_row;
  state.S[c].solve(&state.b[first], &state.lambda[first]);
  for (int row = first; row < first + cluster.row_count; ++row) {
    ws.joints[cluster.root].p.moment -= state.K[row].moment * state.lambda[row];
    ws.joints[cluster.root].p.force -= state.K[row].force * state.lambda[row];
  }
}

// The same for a front.
template <class Scalar, class Propagate>
void propagate_front(Workspace<Scalar>& ws, const FrontPlan& front, Propagate propagate) {
  LoopState<Scalar>& state = ws.loop;
  for (std::size_t k = 0; k < front.joints.size(); ++k) {
    const int begin = front.crossing_begin[k], end = front.crossing_begin[k + 1];
    propagate(front.joints[k]);
    update_rows(front.crossings.data() + begin, front.crossings.data() + end,
                state.front_u.data() + front.first_crossing + begin, ws.joints[front.joints[k]], state.b);
  }
  substitute_right_hand_sides(front, state);
  if (front.root != ground) add_root_bias(front, state, ws.joints[front.root].p);
}

// Accelerations (nv), at rest and without gravity, for joint forces (nv; null: zero) and for prescribed
// accelerations b of the loop rows, J qdd = b, in ws.loop.b. Uses the elimination of the last
// forward_dynamics in the workspace (same or nearby q); overwrites p, u, acceleration, lambda and b.
template <class Scalar>
void respond(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* forces, Scalar* qdd) {
  for (auto& s : ws.joints) s.p = Force<Scalar>::zero();
  const auto propagate = [&](int i) { propagate_force(plan, ws, i, forces ? forces[i] : Scalar(0)); };
  if (!plan.has_constraints()) {
    const int n = static_cast<int>(plan.joints.size());
    for (int i = n - 1; i >= 0; --i) propagate(i);
    for (int i = 0; i < n; ++i) accelerate_joint(plan, ws, i, qdd, Scalar(0), /*at_rest=*/true);
    return;
  }
  for (const EliminationStep& step : elimination_steps(plan, ws.loop)) {
    if (step.kind == EliminationStep::Kind::joint)
      propagate(step.index);
    else if (plan.is_front(step))
      propagate_front(ws, plan.fronts[step.index], propagate);
    else
      propagate_cluster(plan, ws, static_cast<std::size_t>(step.index), propagate);
  }
  accelerate_with_loops(plan, ws, qdd, /*at_rest=*/true);
}

// delta = -M^-1 J^T (J M^-1 J^T)^+ r: the change of q or qd with minimum norm in the mass metric that cancels
// the residuals r to first order. Reads b = -r from ws.loop.b; otherwise like `respond`.
template <class Scalar>
void correct_loops(const Plan<Scalar>& plan, Workspace<Scalar>& ws, Scalar* delta) {
  respond(plan, ws, static_cast<const Scalar*>(nullptr), delta);
}

}  // namespace redysim
