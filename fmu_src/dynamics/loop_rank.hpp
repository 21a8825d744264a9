#pragma once

#include <algorithm>
#include <cmath>

#include "dynamics/workspace.hpp"

// Which rows of a cluster count as constraints, after all of them have passed its joints.

namespace redysim {

// Rows that no joint is left to yield to, because motions are prescribed, are no constraints: what they have
// of S is the rounding of levers that are zero. Here the levers are known; the factor sees S alone.
template <class Scalar>
void drop_unmoved_groups(const ClusterPlan& cluster, const LoopState<Scalar>& state,
                         EnvelopeCholesky<Scalar>& S) {
  const int first = cluster.first_row, count = cluster.row_count;
  Scalar largest(0);
  for (int row = first; row < first + count; ++row)
    if (state.reach[0][row] > largest) largest = state.reach[0][row];
  for (int begin = 0, end = 0; begin < count; begin = end) {
    bool moved = false;
    for (; end < count && cluster.row_group[end] == cluster.row_group[begin]; ++end)
      moved = moved || state.reach[1][first + end] > EnvelopeCholesky<Scalar>::zero_group * largest;
    if (!moved) S.clear(begin, end);
  }
}

// S_rs = sum over the cluster's joints of weight u_r u_s, from the levers that the passages left behind.
template <class Scalar, class Weight>
void sum_passages(const ClusterPlan& cluster, const LoopState<Scalar>& state, EnvelopeCholesky<Scalar>& S,
                  Weight weight) {
  S.set_zero();
  for (std::size_t k = 0; k < cluster.joints.size(); ++k) {
    const Scalar w = weight(cluster.joints[k]);
    for (int n = cluster.passage_begin[k]; n < cluster.passage_begin[k + 1]; ++n)
      for (int m = cluster.passage_begin[k]; m <= n; ++m) {
        const int row = cluster.passages[n].row - cluster.first_row;
        const int other = cluster.passages[m].row - cluster.first_row;
        S.entry(row > other ? row : other, row > other ? other : row) +=
            w * state.passage_u[cluster.first_passage + n] * state.passage_u[cluster.first_passage + m];
      }
  }
}

// The longest lever of a position row on a joint that turns, squared: a slide counts like a turn at it.
template <class Scalar>
Scalar longest_lever(const Plan<Scalar>& plan, const ClusterPlan& cluster, const LoopState<Scalar>& state) {
  Scalar longest(0);
  for (std::size_t k = 0; k < cluster.joints.size(); ++k) {
    if (plan.joints[cluster.joints[k]].prismatic) continue;
    for (int n = cluster.passage_begin[k]; n < cluster.passage_begin[k + 1]; ++n) {
      const Scalar u = state.passage_u[cluster.first_passage + n];
      if (!cluster.row_turns[cluster.passages[n].row - cluster.first_row] && u * u > longest) longest = u * u;
    }
  }
  return longest > Scalar(0) ? longest : Scalar(1);
}

// S = B B^T with B_rj = u_r / sqrt(D_j). Where one joint's D is next to nothing, S has lost the digits of all
// others; B has not.
template <class Scalar>
void factor_levers(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t cluster_index) {
  using std::sqrt;
  const ClusterPlan& cluster = plan.clusters[cluster_index];
  LoopState<Scalar>& state = ws.loop;
  std::vector<Scalar>& B = state.Q[cluster_index];
  const std::size_t columns = cluster.joints.size();
  std::fill(B.begin(), B.end(), Scalar(0));
  for (std::size_t k = 0; k < columns; ++k) {
    if (plan.joints[cluster.joints[k]].prescribed) continue;
    const Scalar root = sqrt(ws.joints[cluster.joints[k]].D_inverse);
    for (int n = cluster.passage_begin[k]; n < cluster.passage_begin[k + 1]; ++n) {
      const std::size_t row = static_cast<std::size_t>(cluster.passages[n].row - cluster.first_row);
      B[row * columns + k] += state.passage_u[cluster.first_passage + n] * root;
    }
  }
  state.S[cluster_index].factor_product(B.data(), static_cast<int>(columns), state.G[cluster_index]);
  state.uses_Q[cluster_index] = true;
}

// What the multipliers add to joint k of the cluster: sum of u lambda, or from Q, where that sum would
// cancel.
template <class Scalar>
Scalar from_loops(const Plan<Scalar>& plan, const Workspace<Scalar>& ws, std::size_t cluster_index,
                  std::size_t k) {
  using std::sqrt;
  const ClusterPlan& cluster = plan.clusters[cluster_index];
  const LoopState<Scalar>& state = ws.loop;
  const int i = cluster.joints[k];
  Scalar sum(0);
  if (state.uses_Q[cluster_index] && !plan.joints[i].prescribed) {
    const std::vector<Scalar>&Q = state.Q[cluster_index], &along = state.S[cluster_index].along();
    for (std::size_t row = 0; row < along.size(); ++row)
      sum += Q[row * cluster.joints.size() + k] * along[row];
    return sum / sqrt(ws.joints[i].D_inverse);
  }
  for (int n = cluster.passage_begin[k]; n < cluster.passage_begin[k + 1]; ++n)
    sum += state.passage_u[cluster.first_passage + n] * state.lambda[cluster.passages[n].row];
  return sum;
}

// Whether the factor of S may be wrong about the rank: a pivot is in doubt, or one is lost while inertias are
// so far apart that rounding of the largest hides the smallest.
template <class Scalar>
bool rank_is_in_doubt(const Plan<Scalar>& plan, const Workspace<Scalar>& ws, std::size_t cluster_index) {
  constexpr double far_apart = 1e4;
  const ClusterPlan& cluster = plan.clusters[cluster_index];
  const EnvelopeCholesky<Scalar>& S = ws.loop.S[cluster_index];
  if (S.doubtful() || S.rank() == S.size()) return S.doubtful();
  const Scalar lever = longest_lever(plan, cluster, ws.loop);
  Scalar most(0), least(0);
  for (int i : cluster.joints) {
    if (plan.joints[i].prescribed) continue;
    const Scalar gives = ws.joints[i].D_inverse * (plan.joints[i].prismatic ? Scalar(1) : lever);
    if (gives > most) most = gives;
    if (least == Scalar(0) || gives < least) least = gives;
  }
  return most > far_apart * least;
}

// Rank is a matter of levers, not of masses: on a link of next to no mass one row's diagonal of S exceeds the
// others' without end. Where pivots leave that open, the dependent rows are those of S with all inertias 1.
template <class Scalar>
void factor_by_geometry(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t cluster_index) {
  const ClusterPlan& cluster = plan.clusters[cluster_index];
  LoopState<Scalar>& state = ws.loop;
  EnvelopeCholesky<Scalar>&S = state.S[cluster_index], &G = state.G[cluster_index];
  const Scalar slide = longest_lever(plan, cluster, state);
  sum_passages(cluster, state, G, [&](int i) {
    return plan.joints[i].prescribed ? Scalar(0) : plan.joints[i].prismatic ? slide : Scalar(1);
  });
  if (plan.has_motion()) drop_unmoved_groups(cluster, state, G);
  G.factor(state.rank_tolerance);
  if (!state.Q[cluster_index].empty()) return factor_levers(plan, ws, cluster_index);
  sum_passages(cluster, state, S, [&](int i) { return ws.joints[i].D_inverse; });
  if (plan.has_motion()) drop_unmoved_groups(cluster, state, S);
  S.factor_like(G);
}

}  // namespace redysim
