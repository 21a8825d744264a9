#pragma once

#include <algorithm>

#include "dynamics/joint_elimination.hpp"
#include "dynamics/loop_rank.hpp"
#include "dynamics/loop_rows.hpp"

// Closed loops in the recursion. A multiplier's wrench travels from both ends of its loop to the
// cluster's root; at each joint passed it adds to the constraint-space inertia S, and at the root
//   S lambda = b - K a_root
// is factored once and folded into the root's articulated inertia, so the bodies below the root cost the
// tree above nothing more (Popov-Vereshchagin with early elimination; derivation: docs/derivations/loops.md).

namespace redysim {

// One passage of a row's wrench w over joint i, with u_r = S_i^T w:
//   b -= (w - U u_r / D) . c + u_r u / D,   w <- X^T (w - U u_r / D),   S_rs += u_r u_s / D           (5)
template <class Scalar>
Scalar pass_joint(const JointPlan<Scalar>& joint, const JointState<Scalar>& s, Force<Scalar>& w, Scalar& b) {
  const Scalar u_row = joint.prismatic ? w.force.z() : w.moment.z();
  const Scalar scaled = u_row * s.D_inverse;
  w.moment -= s.U.moment * scaled;
  w.force -= s.U.force * scaled;
  b -= dot(w, s.c) + scaled * s.u;
  to_parent(joint, s, w);
  return u_row;
}

// All rows over one joint of the cluster.
template <class Scalar>
void pass_rows(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t cluster_index, std::size_t k) {
  const ClusterPlan& cluster = plan.clusters[cluster_index];
  const int i = cluster.joints[k];
  const JointState<Scalar>& s = ws.joints[i];
  LoopState<Scalar>& state = ws.loop;
  EnvelopeCholesky<Scalar>& S = state.S[cluster_index];
  const int begin = cluster.passage_begin[k], end = cluster.passage_begin[k + 1];
  for (int n = begin; n < end; ++n) {
    const RowPassage& passage = cluster.passages[n];
    Force<Scalar>& w = state.wrench[passage.side][passage.row];
    if (passage.merge) {
      add(w, state.wrench[1][passage.row]);
      state.wrench[1][passage.row] = Force<Scalar>::zero();
    }
    const Scalar u_row = pass_joint(plan.joints[i], s, w, state.b[passage.row]);
    state.passage_u[cluster.first_passage + n] = u_row;
    if (plan.has_motion())
      for (int side = 0; side < (plan.joints[i].prescribed ? 1 : 2); ++side)
        if (u_row * u_row > state.reach[side][passage.row]) state.reach[side][passage.row] = u_row * u_row;
    for (int m = begin; m <= n; ++m) {
      const int other = cluster.passages[m].row - cluster.first_row, row = passage.row - cluster.first_row;
      const Scalar term = u_row * state.passage_u[cluster.first_passage + m] * s.D_inverse;
      S.entry(row > other ? row : other, row > other ? other : row) += term;
    }
  }
}

// K at the root, then A_root += K^T S^+ K and p_root -= K^T S^+ b; on the ground b -= K a_ground.
template <class Scalar>
void fold_into_root(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t cluster_index) {
  const ClusterPlan& cluster = plan.clusters[cluster_index];
  LoopState<Scalar>& state = ws.loop;
  const int first = cluster.first_row, count = cluster.row_count;
  for (int row = first; row < first + count; ++row) {
    add(state.K[row], state.wrench[0][row]);
    add(state.K[row], state.wrench[1][row]);
    if (cluster.root == ground) state.b[row] += state.K[row].force.dot(plan.gravity);
  }
  EnvelopeCholesky<Scalar>& S = state.S[cluster_index];
  if (plan.has_motion()) drop_unmoved_groups(cluster, state, S);
  S.factor(state.rank_tolerance);
  state.uses_Q[cluster_index] = false;
  if (rank_is_in_doubt(plan, ws, cluster_index)) factor_by_geometry(plan, ws, cluster_index);
  if (cluster.root == ground) return;
  JointState<Scalar>& root = ws.joints[cluster.root];
  std::vector<Scalar>& x = state.lambda;
  Eigen::Matrix<Scalar, 6, 6> fold;
  for (int column = 0; column < 6; ++column) {
    for (int k = 0; k < count; ++k) x[first + k] = component(state.K[first + k], column);
    S.solve(&x[first], &x[first]);
    for (int line = 0; line <= column; ++line) {
      Scalar sum(0);
      for (int k = 0; k < count; ++k) sum += component(state.K[first + k], line) * x[first + k];
      fold(line, column) = sum;
    }
  }
  add_upper(root.A, fold);
  S.solve(&state.b[first], &x[first]);
  for (int k = 0; k < count; ++k) {
    root.p.moment -= state.K[first + k].moment * x[first + k];
    root.p.force -= state.K[first + k].force * x[first + k];
  }
}

// Leaves to root over joints and clusters. Uses positions, velocities, bias and loop rows.
template <class Scalar>
void eliminate_with_loops(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd,
                          const Scalar* tau) {
  for (auto& S : ws.loop.S) S.set_zero();
  for (auto& reach : ws.loop.reach) std::fill(reach.begin(), reach.end(), Scalar(0));
  for (const EliminationStep& step : plan.elimination) {
    if (!step.is_cluster) {
      eliminate(plan, ws, step.index, q, qd, tau);
      continue;
    }
    const std::size_t c = static_cast<std::size_t>(step.index);
    for (std::size_t k = 0; k < plan.clusters[c].joints.size(); ++k) {
      eliminate(plan, ws, plan.clusters[c].joints[k], q, qd, tau);
      pass_rows(plan, ws, c, k);
    }
    fold_into_root(plan, ws, c);
  }
}

// Root to leaves: multipliers of each cluster as its root's acceleration is known, then the joints.
template <class Scalar>
void accelerate_with_loops(const Plan<Scalar>& plan, Workspace<Scalar>& ws, Scalar* qdd,
                           bool at_rest = false) {
  LoopState<Scalar>& state = ws.loop;
  for (auto step = plan.elimination.rbegin(); step != plan.elimination.rend(); ++step) {
    if (!step->is_cluster) {
      accelerate_joint(plan, ws, step->index, qdd, Scalar(0), at_rest);
      continue;
    }
    const std::size_t c = static_cast<std::size_t>(step->index);
    const ClusterPlan& cluster = plan.clusters[c];
    const int first = cluster.first_row;
    for (int row = first; row < first + cluster.row_count; ++row) {
      state.lambda[row] = state.b[row];
      if (cluster.root != ground)
        state.lambda[row] -= dot(state.K[row], ws.joints[cluster.root].acceleration);
    }
    state.S[c].solve(&state.lambda[first], &state.lambda[first]);
    for (std::size_t k = cluster.joints.size(); k-- > 0;)
      accelerate_joint(plan, ws, cluster.joints[k], qdd, from_loops(plan, ws, c, k), at_rest);
  }
}

}  // namespace redysim
