#pragma once

#include <algorithm>
#include <cmath>

#include "dynamics/loops/loop_rows.hpp"

// Which rows of a cluster count as constraints, after all of them have passed its joints.

namespace redysim {

// Largest lever of a row's wrench on a joint at the end of `path`, squared: a force there with the links
// stretched, and a moment about any axis. The arm in this pose is no measure: in a singular pose it may
// vanish together with the lever.
template <class Scalar>
Scalar turning_lever(const LinkPath<Scalar>& path, const Scalar& least_reach, const Force<Scalar>& w) {
  const Scalar turning = w.moment.squaredNorm(),
               shifted = w.force.squaredNorm() * (path.length * path.length);
  return (turning > shifted ? turning : shifted) + least_reach;
}

template <class Scalar>
Scalar largest_lever(const JointPlan<Scalar>& joint, const LinkPath<Scalar>& path, const Scalar& least_reach,
                     const Force<Scalar>& w) {
  const Scalar force = w.force.squaredNorm();
  if (!turns(joint)) return force;
  return largest_squared(joint, turning_lever(path, least_reach, w), force);
}

// Whether the factor of S may be wrong about the rank: a pivot is in doubt, or one is lost while the joints'
// shares in a row are so far apart that rounding of the largest hides the smallest.
template <class Scalar>
bool rank_is_in_doubt(const ClusterPlan& cluster, const Workspace<Scalar>& ws, std::size_t cluster_index) {
  constexpr double far_apart = 1e-5, nothing = 1e-20;
  const LoopState<Scalar>& state = ws.loop;
  const EnvelopeCholesky<Scalar>& S = state.S[cluster_index];
  if (S.doubtful() || S.rank() == S.size()) return S.doubtful();
  for (std::size_t n = 0; n < cluster.passages.size(); ++n) {
    const Scalar &share = state.passage_scale[cluster.first_passage + n],
                 &scale = state.scale[cluster.passages[n].row];
    if (share < far_apart * scale && share > nothing * scale) return true;
  }
  return false;
}

// One row's wrench down one side of its loop: its levers on the cluster's joints and how long they could be.
template <class Scalar>
[[gnu::cold]] void add_levers(const Plan<Scalar>& plan, const Workspace<Scalar>& ws,
                              const ClusterPlan& cluster, int body, int root, int row, LinkPath<Scalar> path,
                              Force<Scalar> w, Scalar* J, Scalar* reach) {
  using std::sqrt;
  for (std::size_t k = 0; body != root; body = plan.joints[body].parent) {
    const JointPlan<Scalar>& joint = plan.joints[body];
    while (cluster.joints[k] != body) ++k;  // both descend
    path.go_on_to(ws.ground[body].position);
    if (!joint.prescribed) {
      J[k] += generalized_force(joint, w);
      reach[k] += sqrt(largest_lever(joint, path, ws.loop.least_reach[row], w));
    }
    to_parent(joint, ws.joints[body], w);
  }
}

// Levers of all rows of a cluster by geometry alone, each column in units of the longest one of a distance.
template <class Scalar>
[[gnu::cold]] void set_levers(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const ClusterPlan& cluster,
                              Scalar* J, Scalar* reach) {
  const std::size_t columns = cluster.joints.size(), rows = static_cast<std::size_t>(cluster.row_count);
  std::fill(J, J + rows * columns, Scalar(0));
  std::fill(reach, reach + rows * columns, Scalar(0));
  std::vector<Scalar>& longest = ws.loop.longest;
  std::fill(longest.begin(), longest.begin() + static_cast<std::ptrdiff_t>(columns), Scalar(0));
  for (int k = 0; k < cluster.loop_count; ++k) {
    const LoopPlan<Scalar>& loop = plan.loops[cluster.first_loop + k];
    const LoopGeometry<Scalar> geometry = loop_geometry(loop, ws);
    for (std::size_t r = 0; r < loop.rows.size(); ++r) {
      const std::size_t begin = (loop.first_row - cluster.first_row + r) * columns;
      const RowValues<Scalar> values = row_values(geometry, loop.rows[r]);
      const int row = loop.first_row + static_cast<int>(r);
      const LinkPath<Scalar> start{geometry.point_b.position};
      add_levers(plan, ws, cluster, loop.body_a, loop.root, row, start, values.on_a, J + begin,
                 reach + begin);
      add_levers(plan, ws, cluster, loop.body_b, loop.root, row, start, values.on_b, J + begin,
                 reach + begin);
      if (loop.rows[r].kind == ConstraintRow<Scalar>::Kind::rotation) continue;
      for (std::size_t c = 0; c < columns; ++c)
        if (reach[begin + c] > longest[c]) longest[c] = reach[begin + c];
    }
  }
  for (std::size_t n = 0; n < rows * columns; ++n) {
    if (!(longest[n % columns] > Scalar(0))) continue;
    J[n] /= longest[n % columns];
    reach[n] /= longest[n % columns];
  }
}

// B with S = B B^T, B_rj = u_r / sqrt(D_j). Where one joint's D is next to nothing, S has lost the digits of
// all others; B has not.
template <class Scalar>
[[gnu::cold]] void set_weighted_levers(const Plan<Scalar>& plan, const Workspace<Scalar>& ws,
                                       const ClusterPlan& cluster, std::vector<Scalar>& B) {
  using std::sqrt;
  const std::size_t columns = cluster.joints.size();
  std::fill(B.begin(), B.end(), Scalar(0));
  for (std::size_t k = 0; k < columns; ++k) {
    if (plan.joints[cluster.joints[k]].prescribed) continue;
    const Scalar root = sqrt(ws.joints[cluster.joints[k]].D_inverse);
    for (int n = cluster.passage_begin[k]; n < cluster.passage_begin[k + 1]; ++n) {
      const std::size_t row = static_cast<std::size_t>(cluster.passages[n].row - cluster.first_row);
      B[row * columns + k] += ws.loop.passage_u[cluster.first_passage + n] * root;
    }
  }
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

// Rank is a matter of levers, not of masses: on a link of next to no mass one row's diagonal of S exceeds the
// others' without end. Where pivots leave that open, the levers themselves decide. Rare: written once, for
// size.
template <class Scalar>
[[gnu::noinline, gnu::cold]] void factor_by_levers(const Plan<Scalar>& plan, Workspace<Scalar>& ws,
                                                   std::size_t cluster_index) {
  const ClusterPlan& cluster = plan.clusters[cluster_index];
  LoopState<Scalar>& state = ws.loop;
  EnvelopeCholesky<Scalar>& S = state.S[cluster_index];
  std::vector<Scalar>& B = state.Q[cluster_index];
  const int columns = static_cast<int>(cluster.joints.size());
  // B holds the levers first
  set_levers(plan, ws, cluster, B.data(), state.reach.data());
  S.find_dependent(B.data(), state.reach.data(), columns, std::sqrt(state.rank_tolerance));
  set_weighted_levers(plan, ws, cluster, B);
  S.factor_product(B.data(), columns);
  state.uses_Q[cluster_index] = true;
}

}  // namespace redysim
