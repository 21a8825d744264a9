#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "dynamics/ground_motion.hpp"
#include "math/dual.hpp"

// Position, velocity and acceleration level of the cut joints, row by row (docs/derivations/loops.md).
//
// Position row, direction d fixed in its carrier (body a, or the cluster's root), r = x_b - x_a:
//   phi = d . r,  phi' = d . (r' - omega_c x r)                                                       (1)
//   phi'' = d . (x_b'' - x_a'' - alpha_c x r - omega_c x (omega_c x r) - 2 omega_c x (r' - omega_c x r))  (2)
// Rotation row, u fixed in a, v fixed in b:
//   phi = u . v,  phi' = (omega_b - omega_a) . (v x u)                                                (3)
//   phi'' = (alpha_b - alpha_a) . (v x u) + (omega_a x (omega_a x u)) . v
//           + u . (omega_b x (omega_b x v)) + 2 (omega_a x u) . (omega_b x v)                         (4)
// The factors of the accelerations are the row's wrenches on a, b and the carrier.

namespace redysim {

template <class Scalar>
struct LoopGeometry {
  const GroundState<Scalar>&a, &b, &root;
  PointMotion<Scalar> point_a, point_b;
  Vec3<Scalar> r, r_rate;
};

template <class Scalar>
LoopGeometry<Scalar> loop_geometry(const LoopPlan<Scalar>& loop, const Workspace<Scalar>& ws) {
  const GroundState<Scalar>&a = ground_state(ws, loop.entry_a), &b = ground_state(ws, loop.entry_b);
  const PointMotion<Scalar> at_a = point_motion(a, loop.point_a), at_b = point_motion(b, loop.point_b);
  return {a,
          b,
          ground_state(ws, loop.entry_root),
          at_a,
          at_b,
          at_b.position - at_a.position,
          at_b.velocity - at_a.velocity};
}

// One row at the current state: residual, rate, the part of phi'' quadratic in velocities, and the wrenches
// in body axes at the origins of the bodies (`carrier_moment`: on the root, in its axes).
template <class Scalar>
struct RowValues {
  Scalar residual, rate, quadratic;
  Force<Scalar> on_a, on_b;
  Vec3<Scalar> carrier_moment = Vec3<Scalar>::Zero();
};

// Data of a position row: its direction, the angular velocity of the carrier, and r' relative to the carrier.
template <class Scalar>
struct PositionRow {
  bool on_a;
  Vec3<Scalar> d, omega_c, slip;

  PositionRow(const LoopGeometry<Scalar>& g, const ConstraintRow<Scalar>& row)
      : on_a(row.kind == ConstraintRow<Scalar>::Kind::position_on_a),
        d(on_a ? product(g.a.rotation, row.u) : row.u),
        omega_c(on_a ? g.a.omega : g.root.omega),
        slip(g.r_rate - omega_c.cross(g.r)) {}

  Scalar quadratic(const LoopGeometry<Scalar>& g) const {
    const Vec3<Scalar> centripetal = g.b.omega.cross(g.b.omega.cross(g.point_b.arm)) -
                                     g.a.omega.cross(g.a.omega.cross(g.point_a.arm)) -
                                     omega_c.cross(omega_c.cross(g.r)) - Scalar(2) * omega_c.cross(slip);
    return d.dot(centripetal);
  }
};

template <class Scalar>
RowValues<Scalar> position_row(const LoopGeometry<Scalar>& g, const ConstraintRow<Scalar>& row) {
  const PositionRow<Scalar> at(g, row);
  RowValues<Scalar> values;
  values.residual = at.d.dot(g.r);
  values.rate = at.d.dot(at.slip);
  values.quadratic = at.quadratic(g);
  // if a is the carrier, the force on a acts at x_b
  const Vec3<Scalar> arm_a = at.on_a ? Vec3<Scalar>(g.point_a.arm + g.r) : g.point_a.arm;
  values.on_b = {transposed_product<Scalar>(g.b.rotation, g.point_b.arm.cross(at.d)),
                 transposed_product(g.b.rotation, at.d)};
  values.on_a = {transposed_product<Scalar>(g.a.rotation, at.d.cross(arm_a)),
                 -transposed_product(g.a.rotation, at.d)};
  if (!at.on_a) values.carrier_moment = transposed_product<Scalar>(g.root.rotation, at.d.cross(g.r));
  return values;
}

template <class Scalar>
RowValues<Scalar> rotation_row(const LoopGeometry<Scalar>& g, const ConstraintRow<Scalar>& row) {
  const Vec3<Scalar> u = product(g.a.rotation, row.u), v = product(g.b.rotation, row.v);
  const Vec3<Scalar> moment = v.cross(u);
  const Vec3<Scalar> u_rate = g.a.omega.cross(u), v_rate = g.b.omega.cross(v);
  RowValues<Scalar> values;
  values.residual = u.dot(v);
  values.rate = moment.dot(g.b.omega - g.a.omega);
  values.quadratic =
      g.a.omega.cross(u_rate).dot(v) + u.dot(g.b.omega.cross(v_rate)) + Scalar(2) * u_rate.dot(v_rate);
  values.on_b = {transposed_product(g.b.rotation, moment), Vec3<Scalar>::Zero()};
  values.on_a = {-transposed_product(g.a.rotation, moment), Vec3<Scalar>::Zero()};
  return values;
}

template <class Scalar>
RowValues<Scalar> row_values(const LoopGeometry<Scalar>& g, const ConstraintRow<Scalar>& row) {
  return row.kind == ConstraintRow<Scalar>::Kind::rotation ? rotation_row(g, row) : position_row(g, row);
}

template <class Scalar>
struct RowViolation {
  Scalar residual, rate;
};

// Residual and rate of a row as in row_values, without the terms for accelerations and forces.
template <class Scalar>
RowViolation<Scalar> row_violation(const LoopGeometry<Scalar>& g, const ConstraintRow<Scalar>& row) {
  if (row.kind == ConstraintRow<Scalar>::Kind::rotation) {
    const Vec3<Scalar> u = product(g.a.rotation, row.u), v = product(g.b.rotation, row.v);
    return {u.dot(v), v.cross(u).dot(g.b.omega - g.a.omega)};
  }
  const bool on_a = row.kind == ConstraintRow<Scalar>::Kind::position_on_a;
  const Vec3<Scalar> d = on_a ? product(g.a.rotation, row.u) : row.u;
  const Vec3<Scalar>& omega_c = on_a ? g.a.omega : g.root.omega;
  return {d.dot(g.r), d.dot(g.r_rate - omega_c.cross(g.r))};
}

// Square of the minimum moment of a position row that exceeds the rounding errors of the positions, m^2.
template <class Scalar>
Scalar squared_moment_rounding(const LoopGeometry<Scalar>& g, const ConstraintRow<Scalar>& row) {
  constexpr double relative = 1e-9;
  if (row.kind == ConstraintRow<Scalar>::Kind::rotation) return Scalar(0);
  return relative * relative *
         (g.a.position.squaredNorm() + g.b.position.squaredNorm() + g.point_a.arm.squaredNorm() +
          g.point_b.arm.squaredNorm());
}

// Sets b of loop `n` like set_rows_of_loop.
template <class Scalar>
void set_quadratic_parts(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t n) {
  const LoopPlan<Scalar>& loop = plan.loops[n];
  const LoopGeometry<Scalar> geometry = loop_geometry(loop, ws);
  for (std::size_t k = 0; k < loop.rows.size(); ++k) {
    const ConstraintRow<Scalar>& row = loop.rows[k];
    ws.loop.b[static_cast<std::size_t>(loop.first_row) + k] =
        -(row.kind == ConstraintRow<Scalar>::Kind::rotation ? rotation_row(geometry, row).quadratic
                                                            : PositionRow(geometry, row).quadratic(geometry));
  }
}

// Fills residual, rate, wrenches and b = -phi'' (at zero accelerations) of loop `n`. Uses ws.ground.
template <class Scalar>
void set_rows_of_loop(const Plan<Scalar>& plan, Workspace<Scalar>& ws, std::size_t n) {
  LoopState<Scalar>& state = ws.loop;
  const LoopPlan<Scalar>& loop = plan.loops[n];
  const LoopGeometry<Scalar> geometry = loop_geometry(loop, ws);
  state.path[0][n] = state.path[1][n] = {geometry.point_b.position};
  for (std::size_t k = 0; k < loop.rows.size(); ++k) {
    const std::size_t row = static_cast<std::size_t>(loop.first_row) + k;
    const RowValues<Scalar> values = row_values(geometry, loop.rows[k]);
    state.residual[row] = values.residual;
    state.rate[row] = values.rate;
    state.b[row] = -values.quadratic;
    state.squared_moment_rounding[row] = squared_moment_rounding(geometry, loop.rows[k]);
    state.wrench[0][row] = values.on_a;
    state.wrench[1][row] = values.on_b;
    state.K[row].moment = values.carrier_moment;
    state.K[row].force.setZero();
  }
}

// The same for all loops.
template <class Scalar>
void set_loop_rows(const Plan<Scalar>& plan, Workspace<Scalar>& ws) {
  for (std::size_t n = 0; n < plan.loops.size(); ++n) set_rows_of_loop(plan, ws, n);
}

// Magnitudes of the terms of a loop's residuals: m, m/s and rad/s. All its bodies are included, since the
// motions of the joints may cancel at its ends.
struct LoopMagnitudes {
  double distance = 0, speed = 0, spin = 0;

  template <class Scalar>
  void include(const GroundState<Scalar>& body) {
    distance = std::max(distance, size(body.position));
    speed = std::max(speed, size(body.velocity));
    spin = std::max(spin, size(body.omega));
  }

  template <class Scalar>
  static double size(const Vec3<Scalar>& v) {
    return value_of(v.template lpNorm<Eigen::Infinity>());
  }
};

template <class Scalar>
LoopMagnitudes loop_magnitudes(const Plan<Scalar>& plan, const Workspace<Scalar>& ws,
                               const LoopPlan<Scalar>& loop, const LoopGeometry<Scalar>& g) {
  LoopMagnitudes size;
  if (loop.root != ground)
    size.include(g.root);  // the ground's position is that of its origin relative to plan.origin
  for (int body : {loop.body_a, loop.body_b})
    for (; body != loop.root; body = plan.joints[body].parent) size.include(ws.ground[body]);
  const double arms = size.size(g.point_a.arm) + size.size(g.point_b.arm);
  size.distance += arms;
  size.speed += size.spin * arms;
  return size;
}

// Sets residuals and rates of the rows of loops and, `with_sizes`, the magnitudes of their terms.
template <class Scalar>
void set_loop_residuals(const Plan<Scalar>& plan, Workspace<Scalar>& ws, bool with_sizes) {
  for (const auto& loop : plan.loops) {
    const LoopGeometry<Scalar> geometry = loop_geometry(loop, ws);
    const LoopMagnitudes magnitudes =
        with_sizes ? loop_magnitudes(plan, ws, loop, geometry) : LoopMagnitudes();
    for (std::size_t k = 0; k < loop.rows.size(); ++k) {
      const std::size_t row = static_cast<std::size_t>(loop.first_row) + k;
      const RowViolation<Scalar> values = row_violation(geometry, loop.rows[k]);
      ws.loop.residual[row] = values.residual;
      ws.loop.rate[row] = values.rate;
      if (!with_sizes) continue;
      const bool turns = loop.rows[k].kind == ConstraintRow<Scalar>::Kind::rotation;
      ws.loop.residual_size[row] = turns ? 1 : magnitudes.distance;
      ws.loop.rate_size[row] = turns ? magnitudes.spin : magnitudes.speed;
    }
  }
}

// Violation of one row after set_constraint_residuals, relative to the magnitude of the terms of its residual
// (or rate): 1e-16 is a rounding error for any size of the mechanism.
template <class Scalar>
double relative_violation(const LoopState<Scalar>& loop, bool velocity, std::size_t row) {
  const std::vector<Scalar>& residual = velocity ? loop.rate : loop.residual;
  const std::vector<double>& size = velocity ? loop.rate_size : loop.residual_size;
  return std::abs(value_of(residual[row])) / std::max(size[row], 1e-300);
}

// Maximum over all rows.
template <class Scalar>
double relative_violation(const LoopState<Scalar>& loop, bool velocity) {
  double worst = 0;
  for (std::size_t row = 0; row < loop.residual.size(); ++row) {
    const double relative = relative_violation(loop, velocity, row);
    if (!(relative <= worst)) worst = relative;
    if (std::isnan(worst)) break;
  }
  return worst;
}

// Convergence of Newton corrections, row by row: in a loop at rest the rates are rounding errors at any scale
// and must not end the corrections of other loops.
class ResidualProgress {
 public:
  explicit ResidualProgress(std::size_t rows = 0) : before_(rows) {}
  void restart() { std::fill(before_.begin(), before_.end(), std::numeric_limits<double>::infinity()); }

  // Whether some row has a violation above `rounding` and has halved it in each call since the restart.
  template <class Scalar>
  bool goes_on(const LoopState<Scalar>& loop, bool velocity, double rounding) {
    bool any = false;
    for (std::size_t row = 0; row < before_.size(); ++row) {
      const double now = relative_violation(loop, velocity, row);
      const bool halved = now > rounding && now < 0.5 * before_[row];
      before_[row] = halved ? now : 0;
      any = any || halved;
    }
    return any;
  }

 private:
  std::vector<double> before_;
};

// Norm of a loop's position residuals (m and rad combined).
template <class Scalar>
Scalar loop_gap(const LoopPlan<Scalar>& loop, const Workspace<Scalar>& ws) {
  using std::sqrt;
  Scalar sum(0);
  for (std::size_t k = 0; k < loop.rows.size(); ++k) {
    const Scalar& phi = ws.loop.residual[static_cast<std::size_t>(loop.first_row) + k];
    sum += phi * phi;
  }
  return sqrt(sum);
}

}  // namespace redysim
