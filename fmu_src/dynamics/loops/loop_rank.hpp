#pragma once

#include <algorithm>
#include <cmath>

#include "dynamics/loops/loop_rows.hpp"

// Rank decision: which rows of a cluster are independent constraints (docs/derivations/loops.md).

namespace redysim {

// Squared upper bound of the moment of a row's wrench about an axis at the end of a path of links: the moment
// about the best axis, or that of the force with the links stretched. The arm in the current configuration is
// not used: in a singular configuration it may vanish together with the lever.
template <class Scalar>
Scalar squared_moment_bound(double path_length, const Scalar& squared_rounding, const Force<Scalar>& w) {
  const Scalar moment = w.moment.squaredNorm(),
               stretched = w.force.squaredNorm() * (path_length * path_length);
  return (moment > stretched ? moment : stretched) + squared_rounding;
}

// Squared upper bound of the lever (the generalized force of the wrench on `joint`).
template <class Scalar>
Scalar squared_lever_bound(const JointPlan<Scalar>& joint, double path_length, const Scalar& squared_rounding,
                           const Force<Scalar>& w) {
  const Scalar force = w.force.squaredNorm();
  if (!turns(joint)) return force;
  return largest_squared(joint, squared_moment_bound(path_length, squared_rounding, w), force);
}

// Whether the rank of the factor of S is uncertain: a pivot is doubtful, or a row was found dependent
// although the contributions of the joints to its scale differ so much that rounding of the largest may hide
// the smallest.
template <class Scalar>
bool rank_is_uncertain(const ClusterPlan& cluster, const Workspace<Scalar>& ws, std::size_t cluster_index) {
  constexpr double far_apart = 1e-5, negligible = 1e-20;
  const LoopState<Scalar>& state = ws.loop;
  const EnvelopeCholesky<Scalar>& S = state.S[cluster_index];
  if (S.doubtful() || S.rank() == S.size()) return S.doubtful();
  for (std::size_t n = 0; n < cluster.crossings.size(); ++n) {
    const Scalar &share = state.crossing_scale[cluster.first_crossing + n],
                 &scale = state.scale[cluster.crossings[n].row];
    if (share < far_apart * scale && share > negligible * scale) return true;
  }
  return false;
}

// Sets the lengths of the paths from the point of a loop to each joint of one side, m.
template <class Scalar>
[[gnu::cold]] void set_path_lengths(const Plan<Scalar>& plan, const Workspace<Scalar>& ws, int body, int root,
                                    LinkPath<Scalar> path, std::vector<double>& lengths) {
  for (; body != root; body = plan.joints[body].parent) {
    path.extend_to(ws.ground[body].position);
    lengths[body] = path.length;
  }
}

// Adds the levers of one row on the joints of one side of its loop, and their bounds.
template <class Scalar>
[[gnu::cold]] void add_levers(const Plan<Scalar>& plan, const Workspace<Scalar>& ws,
                              const ClusterPlan& cluster, int side, int body, int root, int row,
                              Force<Scalar> w, double* J, double* bound) {
  for (std::size_t k = 0; body != root; body = plan.joints[body].parent) {
    const JointPlan<Scalar>& joint = plan.joints[body];
    while (cluster.joints[k] != body) ++k;  // both descend
    if (!joint.prescribed) {
      J[k] += value_of(generalized_force(joint, w));
      bound[k] += std::sqrt(value_of(squared_lever_bound(joint, ws.loop.path_length[side][body],
                                                         ws.loop.squared_moment_rounding[row], w)));
    }
    to_parent(joint, ws.joints[body], w);
  }
}

// Sets the levers of the couplings of a cluster and their bounds: both follow from the ratios.
template <class Scalar>
void add_coupling_levers(const Plan<Scalar>& plan, const ClusterPlan& cluster, double* J, double* bound) {
  const std::size_t columns = cluster.joints.size();
  for (std::size_t column = 0; column < columns; ++column) {
    if (plan.joints[cluster.joints[column]].prescribed) continue;
    for (int n = cluster.crossing_begin[column]; n < cluster.crossing_begin[column + 1]; ++n) {
      const RowCrossing& crossing = cluster.crossings[n];
      const std::size_t at = static_cast<std::size_t>(crossing.row - cluster.first_row) * columns + column;
      if (!crossing.of_coupling()) continue;
      J[at] = crossing.ratio;
      bound[at] = std::abs(crossing.ratio);
    }
  }
}

// Sets the levers of all rows of a cluster and their bounds from the geometry. Each column is divided by
// its maximum bound among the position rows.
template <class Scalar>
[[gnu::cold]] void set_levers(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const ClusterPlan& cluster) {
  const std::size_t columns = cluster.joints.size(), rows = static_cast<std::size_t>(cluster.row_count);
  double *const J = ws.loop.lever.data(), *const bound = ws.loop.lever_bound.data();
  std::fill_n(J, rows * columns, 0.0);
  std::fill_n(bound, rows * columns, 0.0);
  std::vector<double>& unit = ws.loop.column_unit;
  std::fill_n(unit.begin(), columns, 0.0);
  for (int k = 0; k < cluster.loop_count; ++k) {
    const LoopPlan<Scalar>& loop = plan.loops[cluster.first_loop + k];
    const LoopGeometry<Scalar> geometry = loop_geometry(loop, ws);
    const LinkPath<Scalar> start{geometry.point_b.position};
    set_path_lengths(plan, ws, loop.body_a, loop.root, start, ws.loop.path_length[0]);
    set_path_lengths(plan, ws, loop.body_b, loop.root, start, ws.loop.path_length[1]);
    for (std::size_t r = 0; r < loop.rows.size(); ++r) {
      const RowValues<Scalar> values = row_values(geometry, loop.rows[r]);
      const int row = loop.first_row + static_cast<int>(r);
      const std::size_t begin = static_cast<std::size_t>(row - cluster.first_row) * columns;
      add_levers(plan, ws, cluster, 0, loop.body_a, loop.root, row, values.on_a, J + begin, bound + begin);
      add_levers(plan, ws, cluster, 1, loop.body_b, loop.root, row, values.on_b, J + begin, bound + begin);
      if (loop.rows[r].kind == ConstraintRow<Scalar>::Kind::rotation) continue;
      for (std::size_t c = 0; c < columns; ++c) unit[c] = std::max(unit[c], bound[begin + c]);
    }
  }
  add_coupling_levers(plan, cluster, J, bound);
  for (std::size_t n = 0; n < rows * columns; ++n) {
    if (!(unit[n % columns] > 0)) continue;
    J[n] /= unit[n % columns];
    bound[n] /= unit[n % columns];
  }
}

// Sets B with S = B B^T, B_rj = u_r / sqrt(D_j). If one D_j is very small, S has lost the digits of the other
// joints; B has not.
template <class Scalar>
void set_weighted_levers(const Plan<Scalar>& plan, const Workspace<Scalar>& ws, const ClusterPlan& cluster,
                         const EnvelopeCholesky<Scalar>& S, std::vector<Scalar>& B) {
  using std::sqrt;
  const std::size_t columns = cluster.joints.size();
  std::fill(B.begin(), B.end(), Scalar(0));
  for (std::size_t k = 0; k < columns; ++k) {
    if (plan.joints[cluster.joints[k]].prescribed) continue;
    const Scalar root = sqrt(ws.joints[cluster.joints[k]].D_inverse);
    for (int n = cluster.crossing_begin[k]; n < cluster.crossing_begin[k + 1]; ++n) {
      const std::size_t row =
          static_cast<std::size_t>(S.position(cluster.crossings[n].row - cluster.first_row));
      B[row * columns + k] += ws.loop.crossing_u[cluster.first_crossing + n] * root;
    }
  }
}

// Force of the multipliers on joint k of the cluster: the sum of u lambda, or from Q if this sum would suffer
// from cancellation.
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
  for (int n = cluster.crossing_begin[k]; n < cluster.crossing_begin[k + 1]; ++n)
    sum += state.crossing_u[cluster.first_crossing + n] * state.lambda[cluster.crossings[n].row];
  return sum;
}

// Square of the violation of the loops of a cluster, relative to the bounds of their levers. Those of
// couplings are 0.
template <class Scalar>
double squared_violation_of(const ClusterPlan& cluster, const LoopState<Scalar>& state) {
  double sum = 0;
  for (int row = cluster.first_row; row < cluster.first_row + cluster.row_count; ++row) {
    const double bound = value_of(state.squared_bound[0][row]), gap = value_of(state.residual[row]);
    if (bound > 0) sum += gap * gap / bound;
  }
  return sum;
}

// Factors S with the rank of the levers. Linear dependence of rows is a property of the levers, not of the
// masses: a nearly massless link makes a diagonal entry of S arbitrarily large. Rarely called; not inlined,
// for size.
template <class Scalar>
[[gnu::cold, gnu::noinline]] void factor_by_levers(const Plan<Scalar>& plan, Workspace<Scalar>& ws,
                                                   std::size_t cluster_index) {
  const ClusterPlan& cluster = plan.clusters[cluster_index];
  LoopState<Scalar>& state = ws.loop;
  EnvelopeCholesky<Scalar>& S = state.S[cluster_index];
  std::vector<Scalar>& B = state.Q[cluster_index];
  const int columns = static_cast<int>(cluster.joints.size());
  // a tenth of the pivots' tolerance: the levers have a sine, not its square, and lose no digits to inertias
  const double sine_tolerance = std::sqrt(0.1 * state.pivot_tolerance);
  const double squared_violation = squared_violation_of(cluster, state);
  double squared_spin = 0, squared_force = 0;
  for (const int i : cluster.joints) {
    const JointState<Scalar>& s = ws.joints[i];
    squared_spin = std::max(squared_spin, value_of(s.omega.squaredNorm()));
    if (plan.joints[i].prescribed) continue;
    const double force =
        std::abs(value_of(s.u)) + std::sqrt(value_of(s.U.force.squaredNorm() * plan.gravity.squaredNorm()));
    squared_force += force * force * value_of(s.D_inverse);
  }
  const int first = cluster.first_row;
  do {
    set_levers(plan, ws, cluster);
    S.find_dependent({state.lever.data(), state.lever_bound.data(), state.lever_variance.data(), columns,
                      squared_violation},
                     sine_tolerance);
    set_weighted_levers(plan, ws, cluster, S, B);
    S.factor_product(B.data(), columns);
  } while (S.mark_needed(&state.b[first], &state.residual[first], &state.squared_bound[0][first],
                         squared_spin, squared_force));
  state.uses_Q[cluster_index] = true;
}

}  // namespace redysim
