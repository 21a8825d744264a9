#pragma once

#include <algorithm>

#include "dynamics/loops/loop_fronts.hpp"
#include "dynamics/loops/loop_rank.hpp"
#include "dynamics/loops/loop_rows.hpp"

// Closed loops in the recursion (Popov-Vereshchagin with early elimination of constraints,
// docs/derivations/loops.md). The wrench of a multiplier is transmitted from both ends of its loop to the
// cluster's root. Each joint that it crosses contributes to the inverse constraint-space inertia S. At the
// root
//   S lambda = b - K a_root
// is eliminated into the articulated inertia and bias of the root, which is then an ordinary body for its
// parent.

namespace redysim {

// Eliminates joint i from a row of a loop; returns u_r. `share`: set to u_r^2 / D, computed with the lever
// bounds.
template <class Scalar>
REDYSIM_INLINE Scalar eliminate_from_loop(const Plan<Scalar>& plan, Workspace<Scalar>& ws, int i,
                                          const RowCrossing& crossing, Scalar& share) {
  const JointState<Scalar>& s = ws.joints[i];
  LoopState<Scalar>& state = ws.loop;
  Force<Scalar>& w = merged_wrench(state, crossing);
  if (crossing.root) {
    w.moment += state.K[crossing.row].moment;
    state.K[crossing.row] = Force<Scalar>::zero();
  }
  // after the sides of a loop have met, their wrenches cancel: the maximum bounds before are used
  Scalar squared[] = {state.squared_bound[0][crossing.row], state.squared_bound[1][crossing.row]};
  if (!crossing.merge) {
    LinkPath<Scalar>& path = state.path[crossing.side][crossing.loop];
    if (crossing.first) path.extend_to(ws.ground[i].position);
    squared[0] = squared_moment_bound(path.length, state.squared_moment_rounding[crossing.row], w);
    squared[1] = w.force.squaredNorm();
    for (int part = 0; part < 2; ++part) {
      Scalar& largest = state.squared_bound[part][crossing.row];
      if (squared[part] > largest) largest = squared[part];
    }
  }
  share = largest_squared(plan.joints[i], squared[0], squared[1]) * s.D_inverse;
  const Scalar u_row = generalized_force(plan.joints[i], w);
  eliminate_from_row(plan.joints[i], s, u_row, w, state.b[crossing.row]);
  return u_row;
}

// Eliminates joint k of the cluster from all rows that cross it: (5).
template <class Scalar>
void eliminate_from_cluster_rows(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t cluster_index,
                                 std::size_t k) {
  const ClusterPlan& cluster = plan.clusters[cluster_index];
  const int i = cluster.joints[k];
  const JointState<Scalar>& s = ws.joints[i];
  LoopState<Scalar>& state = ws.loop;
  EnvelopeCholesky<Scalar>& S = state.S[cluster_index];
  const int begin = cluster.crossing_begin[k], end = cluster.crossing_begin[k + 1];
  const RowCrossing* const crossings = cluster.crossings.data();
  Scalar* const u = state.crossing_u.data() + cluster.first_crossing;
  for (int n = begin; n < end; ++n) {
    const RowCrossing& crossing = crossings[n];
    Scalar& share = state.crossing_scale[cluster.first_crossing + n];
    const Scalar u_row = crossing.of_coupling()
                             ? eliminate_from_coupling(plan.joints[i], s, crossing, state, share)
                             : eliminate_from_loop(plan, ws, i, crossing, share);
    state.scale[crossing.row] += share;
    u[n] = u_row;
    const int row = crossing.row - cluster.first_row;
    Scalar* const entries = S.entries_of(row);
    for (int m = begin; m <= n; ++m) {
      const int other = crossings[m].row - cluster.first_row;
      (row >= other ? entries[other] : S.entry(other, row)) += u_row * u[m] * s.D_inverse;
    }
  }
}

// Eliminates the cluster's rows at its root: A_root += K^T S^+ K, p_root -= K^T S^+ b; for the ground b -= K
// a_ground.
template <class Scalar>
void eliminate_cluster_rows(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t cluster_index) {
  const ClusterPlan& cluster = plan.clusters[cluster_index];
  LoopState<Scalar>& state = ws.loop;
  const int first = cluster.first_row, count = cluster.row_count;
  for (int row = first; row < first + count; ++row) {
    add(state.K[row], state.wrench[0][row]);
    add(state.K[row], state.wrench[1][row]);
    if (cluster.root == ground) state.b[row] += state.K[row].force.dot(plan.gravity);
  }
  EnvelopeCholesky<Scalar>& S = state.S[cluster_index];
  S.factor(&state.scale[first], state.pivot_tolerance);
  state.uses_Q[cluster_index] = false;
  if (!state.Q[cluster_index].empty() && rank_is_uncertain(cluster, ws, cluster_index))
    factor_by_levers(plan, ws, cluster_index);
  if (cluster.root == ground) return;
  JointState<Scalar>& root = ws.joints[cluster.root];
  std::vector<Scalar>& x = state.lambda;
  Eigen::Matrix<Scalar, 6, 6> added;
  for (int column = 0; column < 6; ++column) {
    for (int k = 0; k < count; ++k) x[first + k] = component(state.K[first + k], column);
    S.solve(&x[first], &x[first]);
    for (int line = 0; line <= column; ++line) {
      Scalar sum(0);
      for (int k = 0; k < count; ++k) sum += component(state.K[first + k], line) * x[first + k];
      added(line, column) = sum;
    }
  }
  add_upper(root.A, added);
  S.solve(&state.b[first], &x[first]);
  for (int k = 0; k < count; ++k) {
    root.p.moment -= state.K[first + k].moment * x[first + k];
    root.p.force -= state.K[first + k].force * x[first + k];
  }
}

// The joints of one step, in descending order.
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

template <class Scalar>
const std::vector<EliminationStep>& elimination_steps(const Plan<Scalar>& plan,
                                                      const LoopState<Scalar>& state) {
  return plan.may_have_fronts && state.by_fronts ? plan.elimination_by_fronts : plan.elimination;
}

// Whether cluster c is eliminated by its fronts.
template <class Scalar>
bool is_by_fronts(const Plan<Scalar>& plan, const LoopState<Scalar>& state, std::size_t c) {
  return plan.may_have_fronts && state.by_fronts && plan.clusters[c].split;
}

// Sets sums over joints to zero: S, its diagonal and the scales of the rows.
template <class Scalar>
void start_elimination(const Plan<Scalar>& plan, LoopState<Scalar>& state) {
  for (std::size_t c = 0; c < plan.clusters.size(); ++c)
    if (!is_by_fronts(plan, state, c)) state.S[c].set_zero();
  for (auto* sum : {&state.scale, &state.squared_bound[0], &state.squared_bound[1]})
    std::fill(sum->begin(), sum->end(), Scalar(0));
  std::fill(state.coupling_wrench.begin(), state.coupling_wrench.end(), Force<Scalar>::zero());
  if (plan.may_have_fronts && state.by_fronts) start_fronts(state);
}

// Eliminates joint k of a step from the rows that cross it. `entry`: index entries of the step's front for
// joint k; advanced to the next joint.
template <class Scalar>
void eliminate_from_rows(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const EliminationStep& step,
                         std::size_t k, const int*& entry) {
  const std::size_t index = static_cast<std::size_t>(step.index);
  if (step.kind == EliminationStep::Kind::cluster) eliminate_from_cluster_rows(plan, ws, index, k);
  if (plan.is_front(step)) entry = eliminate_from_front_rows(plan, ws, plan.fronts[index], k, entry);
}

// Eliminates the rows of a step at its root; false if a row of a front may depend on others.
template <class Scalar>
bool eliminate_rows(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const EliminationStep& step) {
  const std::size_t index = static_cast<std::size_t>(step.index);
  if (step.kind == EliminationStep::Kind::cluster) eliminate_cluster_rows(plan, ws, index);
  return !plan.is_front(step) || eliminate_front_rows(plan, ws, plan.fronts[index]);
}

// Leaves to root: eliminates joints and the rows of clusters or fronts. Uses positions, velocities, bias
// wrenches and loop rows. False if a row of a front may depend on others: the recursion must then be repeated
// with whole clusters.
template <class Scalar>
bool eliminate_with_loops(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd,
                          const Scalar* tau, bool by_fronts) {
  ws.loop.by_fronts = by_fronts && plan.may_have_fronts;
  start_elimination(plan, ws.loop);
  for (const EliminationStep& step : elimination_steps(plan, ws.loop)) {
    const StepJoints joints = joints_of(plan, step);
    const int* entry = plan.is_front(step) ? plan.fronts[step.index].entries.data() : nullptr;
    for (std::size_t k = 0; k < joints.count; ++k) {
      eliminate(plan, ws, joints.first[k], q, qd, tau);
      eliminate_from_rows(plan, ws, step, k, entry);
    }
    if (!eliminate_rows(plan, ws, step)) return false;
  }
  return true;
}

// One step of iterative refinement of the multipliers. The residual is b - K a_root - B (B^T lambda) with S =
// B B^T: the condition number of B is the square root of that of S. Overwrites b.
template <class Scalar>
[[gnu::noinline]] void refine_multipliers(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t c) {
  const ClusterPlan& cluster = plan.clusters[c];
  LoopState<Scalar>& state = ws.loop;
  const int first = cluster.first_row;
  for (int row = first; row < first + cluster.row_count && cluster.root != ground; ++row)
    state.b[row] -= dot(state.K[row], ws.joints[cluster.root].acceleration);
  for (std::size_t k = 0; k < cluster.joints.size(); ++k) {
    const int begin = cluster.crossing_begin[k], end = cluster.crossing_begin[k + 1];
    const Scalar* const u = state.crossing_u.data() + cluster.first_crossing;
    Scalar force(0);
    for (int n = begin; n < end; ++n) force += u[n] * state.lambda[cluster.crossings[n].row];
    force *= ws.joints[cluster.joints[k]].D_inverse;
    for (int n = begin; n < end; ++n) state.b[cluster.crossings[n].row] -= u[n] * force;
  }
  state.S[c].solve(&state.b[first], &state.b[first]);
  for (int row = first; row < first + cluster.row_count; ++row) state.lambda[row] += state.b[row];
}

// Multipliers of one cluster from the acceleration of its root.
template <class Scalar>
void set_multipliers(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t c) {
  LoopState<Scalar>& state = ws.loop;
  const ClusterPlan& cluster = plan.clusters[c];
  const int first = cluster.first_row;
  EnvelopeCholesky<Scalar>& S = state.S[c];
  for (int row = first; row < first + cluster.row_count; ++row) {
    state.lambda[row] = state.b[row];
    if (cluster.root != ground) state.lambda[row] -= dot(state.K[row], ws.joints[cluster.root].acceleration);
  }
  S.solve(&state.lambda[first], &state.lambda[first]);
  S.reduce_norm(&state.lambda[first]);
  if (!state.uses_Q[c] && S.inexact()) refine_multipliers(plan, ws, c);
}

// Root to leaves, in reverse order of the elimination: multipliers, then the joints on which they act.
template <class Scalar>
void accelerate_with_loops(const Plan<Scalar>& plan, Workspace<Scalar>& ws, Scalar* qdd,
                           bool at_rest = false) {
  using Kind = EliminationStep::Kind;
  const std::vector<EliminationStep>& steps = elimination_steps(plan, ws.loop);
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    const StepJoints joints = joints_of(plan, *step);
    const std::size_t index = static_cast<std::size_t>(step->index);
    if (step->kind == Kind::cluster) set_multipliers(plan, ws, index);
    const bool front = plan.is_front(*step);
    if (front) set_multipliers(ws, plan.fronts[index]);
    for (std::size_t k = joints.count; k-- > 0;) {
      const Scalar force = step->kind == Kind::joint ? Scalar(0)
                           : front                   ? from_loops(ws, plan.fronts[index], k)
                                                     : from_loops(plan, ws, index, k);
      accelerate_joint(plan, ws, joints.first[k], qdd, force, at_rest);
    }
  }
}

}  // namespace redysim
