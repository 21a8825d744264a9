#pragma once

#include "dynamics/loops/loop_elimination.hpp"

namespace redysim {

// Leaves to root at rest: one joint pushed by `force` against what its subtree answers.
template <class Scalar>
void pass_force(const Plan<Scalar>& plan, Workspace<Scalar>& ws, int i, const Scalar& force) {
  const JointPlan<Scalar>& joint = plan.joints[i];
  JointState<Scalar>& s = ws.joints[i];
  s.u = force - generalized_force(joint, s.p);
  if (joint.parent == ground) return;
  const Scalar scaled = s.u * s.D_inverse;
  Force<Scalar> p{s.p.moment + s.U.moment * scaled, s.p.force + s.U.force * scaled};
  to_parent(joint, s, p);
  add(ws.joints[joint.parent].p, p);
}

// What a joint's push makes of the rows that cross it.
template <class Scalar>
void push_rows(const RowPassage* begin, const RowPassage* end, const Scalar* u, const JointState<Scalar>& s,
               std::vector<Scalar>& b) {
  for (; begin != end; ++begin, ++u) b[begin->row] -= *u * s.u * s.D_inverse;
}

template <class Scalar, class Pass>
void pass_cluster(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t c, Pass pass) {
  const ClusterPlan& cluster = plan.clusters[c];
  LoopState<Scalar>& state = ws.loop;
  for (std::size_t k = 0; k < cluster.joints.size(); ++k) {
    const int begin = cluster.passage_begin[k], end = cluster.passage_begin[k + 1];
    pass(cluster.joints[k]);
    push_rows(cluster.passages.data() + begin, cluster.passages.data() + end,
              state.passage_u.data() + cluster.first_passage + begin, ws.joints[cluster.joints[k]], state.b);
  }
  if (cluster.root == ground) return;
  const int first = cluster.first_row;
  state.S[c].solve(&state.b[first], &state.lambda[first]);
  for (int row = first; row < first + cluster.row_count; ++row) {
    ws.joints[cluster.root].p.moment -= state.K[row].moment * state.lambda[row];
    ws.joints[cluster.root].p.force -= state.K[row].force * state.lambda[row];
  }
}

template <class Scalar, class Pass>
void pass_front(Workspace<Scalar>& ws, const FrontPlan& front, Pass pass) {
  LoopState<Scalar>& state = ws.loop;
  for (std::size_t k = 0; k < front.joints.size(); ++k) {
    const int begin = front.passage_begin[k], end = front.passage_begin[k + 1];
    pass(front.joints[k]);
    push_rows(front.passages.data() + begin, front.passages.data() + end,
              state.front_u.data() + front.first_passage + begin, ws.joints[front.joints[k]], state.b);
  }
  pass_sides(front, state);
  if (front.root != ground) push_root(front, state, ws.joints[front.root].p);
}

// Accelerations at rest, without gravity, that answer joint forces (nv; null: none) and make the
// accelerations of the loop rows b, read from ws.loop.b. Uses the elimination that forward_dynamics left in
// the workspace (same or nearby q); overwrites p, u, acceleration, lambda and b.
template <class Scalar>
void respond(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* forces, Scalar* qdd) {
  LoopState<Scalar>& state = ws.loop;
  for (auto& s : ws.joints) s.p = Force<Scalar>::zero();
  const auto pass = [&](int i) { pass_force(plan, ws, i, forces ? forces[i] : Scalar(0)); };
  if (!plan.has_loops()) {
    const int n = static_cast<int>(plan.joints.size());
    for (int i = n - 1; i >= 0; --i) pass(i);
    for (int i = 0; i < n; ++i) accelerate_joint(plan, ws, i, qdd, Scalar(0), /*at_rest=*/true);
    return;
  }
  for (const EliminationStep& step : plan.has_fronts() && state.early ? plan.early : plan.elimination) {
    if (step.kind == EliminationStep::Kind::joint)
      pass(step.index);
    else if (plan.is_front(step))
      pass_front(ws, plan.fronts[step.index], pass);
    else
      pass_cluster(plan, ws, static_cast<std::size_t>(step.index), pass);
  }
  accelerate_with_loops(plan, ws, qdd, /*at_rest=*/true);
}

// delta = -M^-1 J^T (J M^-1 J^T)^+ r: the smallest change of q or qd in the mass metric that takes the
// residuals r away to first order; reads r from ws.loop.b with its sign turned, b = -r. As `respond`.
template <class Scalar>
void correct_loops(const Plan<Scalar>& plan, Workspace<Scalar>& ws, Scalar* delta) {
  respond(plan, ws, static_cast<const Scalar*>(nullptr), delta);
}

}  // namespace redysim
