#pragma once

#include <algorithm>
#include <cmath>

#include "dynamics/joint_elimination.hpp"
#include "dynamics/loops/loop_rank.hpp"

// Multifrontal elimination (docs/derivations/loops.md). A front eliminates the loops that meet at one body;
// rows of other loops that cross the same joints stay open. In
//   S lambda + C^T lambda_open = b - K a_root,    C lambda + S_open lambda_open = b_open - K_open a_root
// the first equation is eliminated from the second and from the root, with S = L L^T:
//   C <- C L^-T,  K <- L^-1 K,  b <- L^-1 b,  S_open -= C C^T,  K_open -= C K,  b_open -= C b          (6)
//   A_root += K^T K,  p_root -= K^T b
// Used only while all rows are clearly independent; the multipliers are then unique.

namespace redysim {

// Eliminates the acceleration of joint i from a row and transmits the row's wrench w over the joint, with
// u_r = S_i^T w, plus the ratio in the row of a coupling:
//   b -= (w - U u_r / D) . c + u_r u / D,   w <- X^T (w - U u_r / D),   S_rs += u_r u_s / D           (5)
template <class Scalar>
void eliminate_from_row(const JointPlan<Scalar>& joint, const JointState<Scalar>& s, const Scalar& u_row,
                        Force<Scalar>& w, Scalar& b) {
  const Scalar scaled = u_row * s.D_inverse;
  w.moment -= s.U.moment * scaled;
  w.force -= s.U.force * scaled;
  b -= dot(w, s.c) + scaled * s.u;
  to_parent(joint, s, w);
}

// Eliminates joint i from the row of a coupling and adds its wrench to that on the parent; returns u_r.
// `scale`: set to u_r^2 / D, computed with the lever bounds. Not inlined, for size.
template <class Scalar>
[[gnu::noinline]] Scalar eliminate_from_coupling(const JointPlan<Scalar>& joint, const JointState<Scalar>& s,
                                                 const RowCrossing& crossing, LoopState<Scalar>& state,
                                                 Scalar& scale) {
  Force<Scalar>& w = state.coupling_wrench[crossing.wrench];
  scale = (largest_squared(joint, w.moment.squaredNorm(), w.force.squaredNorm()) +
           crossing.ratio * crossing.ratio) *
          s.D_inverse;
  const Scalar u_row = generalized_force(joint, w) + crossing.ratio;
  eliminate_from_row(joint, s, u_row, w, state.b[crossing.row]);
  add(crossing.inboard < 0 ? state.wrench[0][crossing.row] : state.coupling_wrench[crossing.inboard], w);
  return u_row;
}

template <class Scalar>
void start_fronts(LoopState<Scalar>& state) {
  std::fill(state.front_entries.begin(), state.front_entries.end(), Scalar(0));
  std::fill(state.diagonal.begin(), state.diagonal.end(), Scalar(0));
}

// The wrench of a loop's row on a joint. From the joint where both sides of the loop have met, it is their
// sum.
template <class Scalar>
REDYSIM_INLINE Force<Scalar>& merged_wrench(LoopState<Scalar>& state, const RowCrossing& crossing) {
  Force<Scalar>& w = state.wrench[crossing.side][crossing.row];
  if (crossing.merge) {
    add(w, state.wrench[1][crossing.row]);
    state.wrench[1][crossing.row] = Force<Scalar>::zero();
  }
  return w;
}

// Eliminates joint i from a row of a loop in a front; returns u_r.
template <class Scalar>
REDYSIM_INLINE Scalar eliminate_from_loop_of_front(const Plan<Scalar>& plan, Workspace<Scalar>& ws, int i,
                                                   const RowCrossing& crossing) {
  const JointState<Scalar>& s = ws.joints[i];
  LoopState<Scalar>& state = ws.loop;
  Force<Scalar>& w = merged_wrench(state, crossing);
  if (!crossing.merge) {
    LinkPath<Scalar>& path = state.path[crossing.side][crossing.loop];
    if (crossing.first) path.extend_to(ws.ground[i].position);
    state.scale[crossing.row] +=
        squared_lever_bound(plan.joints[i], path.length, state.squared_moment_rounding[crossing.row], w) *
        s.D_inverse;
  }
  const Scalar u_row = generalized_force(plan.joints[i], w);
  eliminate_from_row(plan.joints[i], s, u_row, w, state.b[crossing.row]);
  return u_row;
}

// Eliminates joint k of the front from all rows that cross it. `entry`: position in front.entries; returns
// the position for the next joint.
template <class Scalar>
const int* eliminate_from_front_rows(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const FrontPlan& front,
                                     std::size_t k, const int* entry) {
  const int i = front.joints[k], begin = front.crossing_begin[k], end = front.crossing_begin[k + 1];
  const JointState<Scalar>& s = ws.joints[i];
  LoopState<Scalar>& state = ws.loop;
  Scalar* u = state.front_u.data() + front.first_crossing;
  for (int n = begin; n < end; ++n) {
    const RowCrossing& crossing = front.crossings[n];
    if (crossing.of_coupling()) {
      Scalar share;
      u[n] = eliminate_from_coupling(plan.joints[i], s, crossing, state, share);
      state.scale[crossing.row] += share;
    } else {
      u[n] = eliminate_from_loop_of_front(plan, ws, i, crossing);
    }
    const Scalar scaled = u[n] * s.D_inverse;
    state.diagonal[crossing.row] += scaled * u[n];
    for (int m = begin; m <= n; ++m) state.front_entries[*entry++] += scaled * u[m];
  }
  return entry;
}

// S <- L, C <- C L^-T. A negative pivot, due to rounding, gives NaN.
template <class Scalar>
void factor_front(const FrontPlan& front, Scalar* matrix) {
  using std::sqrt;
  const std::size_t count = front.rows.size(), lines = count + front.open.size();
  for (std::size_t i = 0; i < lines; ++i) {
    Scalar* row = matrix + i * count;
    for (std::size_t j = 0; j < count && j <= i; ++j) {
      const Scalar* other = matrix + j * count;
      Scalar sum = row[j];
      for (std::size_t k = 0; k < j; ++k) sum -= row[k] * other[k];
      row[j] = i == j ? Scalar(sqrt(sum)) : Scalar(sum / other[j]);
    }
  }
}

// Whether all rows of the front are clearly independent. A row may depend on others if its pivot is small
// compared with its diagonal of S before other rows are eliminated: only rounding errors remain of a
// dependent row. A row vanishes by itself if this diagonal is small compared with its scale.
template <class Scalar>
bool independent(const FrontPlan& front, const LoopState<Scalar>& state, const Scalar* matrix) {
  constexpr double vanishing = 1e-8;
  const std::size_t count = front.rows.size();
  for (std::size_t k = 0; k < count; ++k) {
    const Scalar& length = matrix[k * count + k];
    const Scalar& diagonal = state.diagonal[front.rows[k]];
    if (!(length * length > EnvelopeCholesky<Scalar>::small_pivot * diagonal)) return false;
    if (!(diagonal > vanishing * state.scale[front.rows[k]])) return false;
  }
  return true;
}

// b <- L^-1 b, b_open -= C b.
template <class Scalar>
void substitute_right_hand_sides(const FrontPlan& front, LoopState<Scalar>& state) {
  const std::size_t count = front.rows.size();
  const Scalar* row = &state.front_entries[front.first_entry];
  for (std::size_t i = 0; i < count; ++i, row += count) {
    Scalar& b = state.b[front.rows[i]];
    for (std::size_t j = 0; j < i; ++j) b -= row[j] * state.b[front.rows[j]];
    b /= row[i];
  }
  for (const int open : front.open) {
    for (std::size_t j = 0; j < count; ++j) state.b[open] -= row[j] * state.b[front.rows[j]];
    row += count;
  }
}

// K <- L^-1 K, K_open -= C K.
template <class Scalar>
void substitute_wrenches(const FrontPlan& front, LoopState<Scalar>& state) {
  const auto subtract = [&](Force<Scalar>& from, const Scalar& part, const Force<Scalar>& of) {
    from.moment -= part * of.moment;
    from.force -= part * of.force;
  };
  const std::size_t count = front.rows.size();
  const Scalar* row = &state.front_entries[front.first_entry];
  for (std::size_t i = 0; i < count; ++i, row += count) {
    Force<Scalar>& K = state.K[front.rows[i]];
    for (std::size_t j = 0; j < i; ++j) subtract(K, row[j], state.K[front.rows[j]]);
    K.moment /= row[i];
    K.force /= row[i];
  }
  for (std::size_t n = 0; n < front.open.size(); ++n, row += count) {
    const int side = front.open_side[n];
    Force<Scalar>& open =
        side < 0 ? state.coupling_wrench[front.open_wrench[n]] : state.wrench[side][front.open[n]];
    for (std::size_t j = 0; j < count; ++j) subtract(open, row[j], state.K[front.rows[j]]);
  }
}

// S_open -= C C^T.
template <class Scalar>
void update_couplings(const FrontPlan& front, LoopState<Scalar>& state) {
  const std::size_t count = front.rows.size();
  const Scalar* C = &state.front_entries[front.first_entry] + count * count;
  const int* entry = front.open_entries.data();
  for (std::size_t n = 0; n < front.open.size(); ++n)
    for (std::size_t m = 0; m <= n; ++m, ++entry)
      for (std::size_t j = 0; j < count; ++j)
        state.front_entries[*entry] -= C[n * count + j] * C[m * count + j];
}

// A_root += K^T K.
template <class Scalar>
void add_root_inertia(const FrontPlan& front, const LoopState<Scalar>& state, ArticulatedInertia<Scalar>& A) {
  Eigen::Matrix<Scalar, 6, 6> added;
  for (int column = 0; column < 6; ++column)
    for (int line = 0; line <= column; ++line) {
      Scalar sum(0);
      for (int row : front.rows) sum += component(state.K[row], line) * component(state.K[row], column);
      added(line, column) = sum;
    }
  add_upper(A, added);
}

// p_root -= K^T b.
template <class Scalar>
void add_root_bias(const FrontPlan& front, const LoopState<Scalar>& state, Force<Scalar>& p) {
  for (int row : front.rows) {
    p.moment -= state.K[row].moment * state.b[row];
    p.force -= state.K[row].force * state.b[row];
  }
}

// Eliminates the front's rows at its root; false if a row may depend on others.
template <class Scalar>
bool eliminate_front_rows(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const FrontPlan& front) {
  LoopState<Scalar>& state = ws.loop;
  Scalar* matrix = &state.front_entries[front.first_entry];
  factor_front(front, matrix);
  if (!independent(front, state, matrix)) return false;
  for (int row : front.rows) {
    add(state.K[row], state.wrench[0][row]);
    add(state.K[row], state.wrench[1][row]);
    if (front.root == ground) state.b[row] += state.K[row].force.dot(plan.gravity);
  }
  substitute_right_hand_sides(front, state);
  if (front.root == ground) return true;
  substitute_wrenches(front, state);
  update_couplings(front, state);
  add_root_inertia(front, state, ws.joints[front.root].A);
  add_root_bias(front, state, ws.joints[front.root].p);
  return true;
}

// Multipliers of the front's rows from those of the open rows and the acceleration of the root.
template <class Scalar>
void set_multipliers(Workspace<Scalar>& ws, const FrontPlan& front) {
  LoopState<Scalar>& state = ws.loop;
  const std::size_t count = front.rows.size();
  const Scalar* matrix = &state.front_entries[front.first_entry];
  for (std::size_t i = 0; i < count; ++i) {
    Scalar& lambda = state.lambda[front.rows[i]];
    lambda = state.b[front.rows[i]];
    if (front.root != ground) lambda -= dot(state.K[front.rows[i]], ws.joints[front.root].acceleration);
    for (std::size_t n = 0; n < front.open.size(); ++n)
      lambda -= matrix[(count + n) * count + i] * state.lambda[front.open[n]];
  }
  for (std::size_t i = count; i-- > 0;) {
    Scalar& lambda = state.lambda[front.rows[i]];
    for (std::size_t j = i + 1; j < count; ++j) lambda -= matrix[j * count + i] * state.lambda[front.rows[j]];
    lambda /= matrix[i * count + i];
  }
}

// Force of the multipliers on joint k of the front.
template <class Scalar>
Scalar from_loops(const Workspace<Scalar>& ws, const FrontPlan& front, std::size_t k) {
  Scalar sum(0);
  for (int n = front.crossing_begin[k]; n < front.crossing_begin[k + 1]; ++n)
    sum += ws.loop.front_u[front.first_crossing + n] * ws.loop.lambda[front.crossings[n].row];
  return sum;
}

}  // namespace redysim
