#pragma once

#include "dynamics/loop_elimination.hpp"

namespace redysim {

// delta = -M^-1 J^T (J M^-1 J^T)^+ r: the smallest change of q or qd in the mass metric that takes the
// residuals r away to first order. Uses the elimination that forward_dynamics left in the workspace (same
// or nearby q) and reads r from ws.loop.b with its sign turned, b = -r; overwrites p, u, acceleration,
// lambda.
template <class Scalar>
void correct_loops(const Plan<Scalar>& plan, Workspace<Scalar>& ws, Scalar* delta) {
  LoopState<Scalar>& state = ws.loop;
  for (auto& s : ws.joints) s.p = Force<Scalar>::zero();
  auto pass_up = [&plan, &ws](int i) {
    const JointPlan<Scalar>& joint = plan.joints[i];
    JointState<Scalar>& s = ws.joints[i];
    s.u = joint.prismatic ? -s.p.force.z() : -s.p.moment.z();
    if (joint.parent == ground) return;
    const Scalar scaled = s.u * s.D_inverse;
    Force<Scalar> p{s.p.moment + s.U.moment * scaled, s.p.force + s.U.force * scaled};
    to_parent(joint, s, p);
    add(ws.joints[joint.parent].p, p);
  };
  for (const EliminationStep& step : plan.elimination) {
    if (!step.is_cluster) {
      pass_up(step.index);
      continue;
    }
    const ClusterPlan& cluster = plan.clusters[static_cast<std::size_t>(step.index)];
    for (std::size_t k = 0; k < cluster.joints.size(); ++k) {
      const int i = cluster.joints[k];
      pass_up(i);
      for (int n = cluster.passage_begin[k]; n < cluster.passage_begin[k + 1]; ++n)
        state.b[cluster.passages[n].row] -=
            state.passage_u[cluster.first_passage + n] * ws.joints[i].u * ws.joints[i].D_inverse;
    }
    if (cluster.root == ground) continue;
    const int first = cluster.first_row;
    state.S[static_cast<std::size_t>(step.index)].solve(&state.b[first], &state.lambda[first]);
    for (int row = first; row < first + cluster.row_count; ++row) {
      ws.joints[cluster.root].p.moment -= state.K[row].moment * state.lambda[row];
      ws.joints[cluster.root].p.force -= state.K[row].force * state.lambda[row];
    }
  }
  accelerate_with_loops(plan, ws, delta, /*at_rest=*/true);
}

}  // namespace redysim
