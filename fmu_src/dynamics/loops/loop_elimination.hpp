#pragma once

#include <algorithm>

#include "dynamics/loops/loop_fronts.hpp"
#include "dynamics/loops/loop_rank.hpp"
#include "dynamics/loops/loop_rows.hpp"

// Closed loops in the recursion. A multiplier's wrench travels from both ends of its loop to the
// cluster's root; at each joint passed it adds to the constraint-space inertia S, and at the root
//   S lambda = b - K a_root
// is factored once and folded into the root's articulated inertia, so the bodies below the root cost the
// tree above nothing more (Popov-Vereshchagin with early elimination; derivation: docs/derivations/loops.md).

namespace redysim {

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
    if (passage.root) {
      w.moment += state.K[passage.row].moment;
      state.K[passage.row] = Force<Scalar>::zero();
    }
    // the sides of a loop cancel where they have met: their levers before that are the measure
    Scalar levers[] = {state.length[0][passage.row], state.length[1][passage.row]};
    if (!passage.merge) {
      LinkPath<Scalar>& path = state.path[passage.side][passage.row];
      path.go_on_to(ws.ground[i].position);
      levers[0] = turning_lever(path, state.least_reach[passage.row], w);
      levers[1] = w.force.squaredNorm();
      for (int part = 0; part < 2; ++part) {
        Scalar& longest = state.length[part][passage.row];
        if (levers[part] > longest) longest = levers[part];
      }
    }
    const Scalar share = largest_squared(plan.joints[i], levers[0], levers[1]) * s.D_inverse;
    state.passage_scale[cluster.first_passage + n] = share;
    state.scale[passage.row] += share;
    const Scalar u_row = pass_joint(plan.joints[i], s, w, state.b[passage.row]);
    state.passage_u[cluster.first_passage + n] = u_row;
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
  S.factor(&state.scale[first], state.rank_tolerance);
  state.uses_Q[cluster_index] = false;
  if (!state.Q[cluster_index].empty() && rank_is_in_doubt(cluster, ws, cluster_index))
    factor_by_levers(plan, ws, cluster_index);
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

// The joints of one step, leaves first.
struct StepJoints {
  const int* first;
  std::size_t count;
};

template <class Scalar>
StepJoints joints_of(const Plan<Scalar>& plan, const EliminationStep& step) {
  if (step.kind == EliminationStep::Kind::joint) return {&step.index, 1};
  const std::vector<int>& joints =
      plan.is_front(step) ? plan.fronts[step.index].joints : plan.clusters[step.index].joints;
  return {joints.data(), joints.size()};
}

// Leaves to root over joints, clusters and, by the early way, fronts. Uses positions, velocities, bias and
// loop rows. False if a row of a front may depend on others: the recursion then restarts, cluster by cluster.
template <class Scalar>
bool eliminate_with_loops(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd,
                          const Scalar* tau, bool early) {
  using Kind = EliminationStep::Kind;
  LoopState<Scalar>& state = ws.loop;
  early = early && plan.may_have_fronts;
  state.early = early;
  for (std::size_t c = 0; c < plan.clusters.size(); ++c)
    if (!(early && plan.clusters[c].split)) state.S[c].set_zero();
  for (auto* measure : {&state.scale, &state.length[0], &state.length[1]})
    std::fill(measure->begin(), measure->end(), Scalar(0));
  if (early) start_fronts(state);
  for (const EliminationStep& step : early ? plan.early : plan.elimination) {
    const StepJoints joints = joints_of(plan, step);
    const std::size_t index = static_cast<std::size_t>(step.index);
    const bool front = plan.is_front(step);
    const int* entry = front ? plan.fronts[index].entries.data() : nullptr;
    for (std::size_t k = 0; k < joints.count; ++k) {
      eliminate(plan, ws, joints.first[k], q, qd, tau);
      if (step.kind == Kind::cluster) pass_rows(plan, ws, index, k);
      if (front) entry = pass_open_rows(plan, ws, plan.fronts[index], k, entry);
    }
    if (step.kind == Kind::cluster) fold_into_root(plan, ws, index);
    if (front && !fold_front(plan, ws, plan.fronts[index])) return false;
  }
  return true;
}

// Multipliers of one cluster, as its root's acceleration is known.
template <class Scalar>
void set_multipliers(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t c) {
  LoopState<Scalar>& state = ws.loop;
  const ClusterPlan& cluster = plan.clusters[c];
  const int first = cluster.first_row;
  for (int row = first; row < first + cluster.row_count; ++row) {
    state.lambda[row] = state.b[row];
    if (cluster.root != ground) state.lambda[row] -= dot(state.K[row], ws.joints[cluster.root].acceleration);
  }
  state.S[c].solve(&state.lambda[first], &state.lambda[first]);
  state.S[c].reduce_norm(&state.lambda[first]);
}

// Root to leaves, the way that the elimination took: multipliers, then the joints that they act on.
template <class Scalar>
void accelerate_with_loops(const Plan<Scalar>& plan, Workspace<Scalar>& ws, Scalar* qdd,
                           bool at_rest = false) {
  using Kind = EliminationStep::Kind;
  const std::vector<EliminationStep>& steps =
      plan.has_fronts() && ws.loop.early ? plan.early : plan.elimination;
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    const StepJoints joints = joints_of(plan, *step);
    const std::size_t index = static_cast<std::size_t>(step->index);
    if (step->kind == Kind::cluster) set_multipliers(plan, ws, index);
    const bool front = plan.is_front(*step);
    if (front) set_multipliers(ws, plan.fronts[index]);
    for (std::size_t k = joints.count; k-- > 0;) {
      const Scalar sum = step->kind == Kind::joint ? Scalar(0)
                         : front                   ? from_loops(ws, plan.fronts[index], k)
                                                   : from_loops(plan, ws, index, k);
      accelerate_joint(plan, ws, joints.first[k], qdd, sum, at_rest);
    }
  }
}

// Independent rows of all loops, as the last elimination found them.
template <class Scalar>
int loop_rank(const Plan<Scalar>& plan, const Workspace<Scalar>& ws) {
  int rank = 0;
  for (std::size_t c = 0; c < plan.clusters.size(); ++c)
    rank += plan.has_fronts() && ws.loop.early && plan.clusters[c].split ? plan.clusters[c].row_count
                                                                         : ws.loop.S[c].rank();
  return rank;
}

}  // namespace redysim
