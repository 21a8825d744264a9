#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "dynamics/assembly/assembly.hpp"
#include "dynamics/loops/cluster_rows.hpp"
#include "math/least_norm.hpp"
#include "math/rotation_vector.hpp"

namespace redysim {

// Assembly of one cluster: from its start values to the nearest configuration and velocities that satisfy its
// rows. z: positions of the free joints in their units; phi(z) = 0: the rows; J = d phi / d z.
class ClusterAssembly : public ClusterRows<double> {
 public:
  using Vector = Eigen::VectorXd;
  using Matrix = Eigen::MatrixXd;

  // Norms of residuals, relative to the size of the mechanism, or in rad.
  static constexpr double rounding_residual = 2e-15;  // a smaller one is not corrected
  static constexpr double accepted_residual = 1e-10;
  static constexpr double rounded_data = 1e-3;  // maximum residual due to angles such as 1.57

  ClusterAssembly(const Model& model, const Plan<double>& plan, Workspace<double>& ws,
                  const ClusterPlan& cluster)
      : ClusterRows(model, plan, ws, cluster), model_(model) {}

  // Sets the initial configuration and the unit of length; returns the norm of the residuals.
  double start(const double* q) {
    set_pose(q);
    measure();
    z_start_.resize(static_cast<Eigen::Index>(free_.size()));
    for (std::size_t j = 0; j < free_.size(); ++j) z_start_[j] = q[free_[j]] / unit(free_[j]);
    return residual_norm(z_start_);
  }

  const Vector& z_start() const { return z_start_; }
  double accepted() const { return std::max(accepted_residual, rounding_); }

  // Minimises the residuals by Levenberg-Marquardt steps with damping proportional to the residual: quadratic
  // convergence at regular configurations, robust at singular ones. Returns the norm of the residuals.
  double minimize_residual(Vector& z) {
    double norm = residual_norm(z);
    if (coupling_count() > 0) norm = go_along_couplings(z, norm);
    double damping_factor = 1;
    int idle = 0;
    for (int k = 0; k < 100 && norm > rounding_residual && idle < 3; ++k) {
      const double before = norm;
      const Matrix J = J_;
      std::unique_ptr<LeastNorm> tangent;
      const Vector wanted = -phi_;
      for (int attempt = 0; attempt < 8; ++attempt) {
        const double damping = std::max(norm * damping_factor, smallest_damping);
        if (damping < coarse_damping && !tangent)
          tangent = std::make_unique<LeastNorm>(J, smallest_damping, rounding_);
        Vector step = damping < coarse_damping ? tangent->solve(wanted, damping) : damped(J, wanted, damping);
        const double length = step.norm();
        if (length > 1) step /= length;
        const Vector trial = z + step;
        const double there = residual_norm(trial);
        if (there < norm) {
          z = trial;
          norm = there;
          damping_factor = std::max(0.25 * damping_factor, 1e-3);
          break;
        }
        if (norm < 1e-13) break;
        damping_factor *= 4;
      }
      idle = norm < (1 - 1e-5) * before ? 0 : idle + 1;
      if (norm == before) break;
    }
    residual_norm(z);
    return norm;
  }

  // Moves from a configuration that satisfies the loops to the one nearest to the start, by Newton steps in
  // the tangent space.
  void move_to_nearest(Vector& z) {
    double distance = (z - z_start_).norm(), gradient = 0;
    for (int k = 0; k < 60; ++k) {
      residual_norm(z);
      const LeastNorm tangent(J_, dependent, rounding_);
      const Vector away = z_start_ - z;
      const Vector along = away - tangent.solve(times(J_, away));
      if (along.norm() < near_enough * std::max(1.0, distance) || (gradient > 0 && along.norm() > gradient))
        break;
      const Vector step = newton_step(z, tangent, along, tangent.solve_transposed(away));
      // close to the solution, distances differ by rounding only: the gradient decides
      const bool converging = step.norm() < 1e-4;
      gradient = converging ? along.norm() : 0;
      bool nearer = false;
      for (double part = 1; part > 0.01 && !nearer; part *= 0.5) {
        Vector trial = z + part * step;
        if (minimize_residual(trial) > accepted()) continue;
        const double there = (trial - z_start_).norm();
        nearer = converging || there < distance * (1 - 1e-12);
        if (nearer) {
          z = trial;
          distance = there;
        }
      }
      if (!nearer) break;
    }
    residual_norm(z);
  }

  // Sets the rows at the velocities qd and updates the maximum velocity so far.
  void set_motion(const double* qd) {
    if (has_loops()) {
      const GroundState<double> root = ground_state(ws_, cluster_.root);
      fastest_ = std::max({fastest_, root.omega.norm(), root.velocity.norm() / size_});
    }
    for (int i : joints_) fastest_ = std::max(fastest_, std::abs(qd[i]) / unit(i));
    ClusterRows::set_motion(qd);
  }

  // Change of qd to the nearest velocities that satisfy the loops, after set_motion(qd).
  void correct_velocities(const double* qd, std::vector<double>& change) {
    Vector step = Vector::Zero(static_cast<Eigen::Index>(free_.size()));
    if (rate_.lpNorm<Eigen::Infinity>() > 0 && !free_.empty())
      step = LeastNorm(J_, dependent, rounding_).solve(-rate_);
    move_to_branch(qd, step);
    for (std::size_t j = 0; j < free_.size(); ++j) change[free_[j]] = step[j] * unit(free_[j]);
  }

  // Whether the rates of a loop after set_motion(qd) are rounding errors compared with the contributions of
  // single joints.
  bool rates_vanish(int k, const double* qd) const {
    const LoopPlan<double>& at = loop(k);
    const LoopGeometry<double> g = loop_geometry(at, ws_);
    for (std::size_t r = 0; r < at.rows.size(); ++r) {
      const RowValues<double> values = row_values(g, at.rows[r]);
      const double speed =
          (largest_rate(at.body_a, values.on_a, qd) + largest_rate(at.body_b, values.on_b, qd)) /
          row_unit(at.rows[r]);
      if (std::abs(rate_[local_row(k, r)]) > rounding_of_rates * speed + rounding_ * fastest_) return false;
    }
    return true;
  }

  bool rates_vanish(const CouplingPlan& at, const double* qd) const {
    double speed = 0;
    for (std::size_t k = 0; k < at.joints.size(); ++k)
      speed = std::max(speed, std::abs(at.ratios[k] * qd[at.joints[k]]));
    return std::abs(rate_[local_row(at)]) <= rounding_of_rates * speed / row_unit(at) + rounding_ * fastest_;
  }

  // Number of constraints: the loops of the cluster, then its couplings.
  int constraint_count() const { return loop_count() + coupling_count(); }
  // Assembly::constraint of constraint k.
  int constraint(int k) const {
    return k < loop_count() ? loop(k).loop : coupling_constraint(model_, coupling(k - loop_count()).coupling);
  }
  bool constraint_rates_vanish(int k, const double* qd) const {
    return k < loop_count() ? rates_vanish(k, qd) : rates_vanish(coupling(k - loop_count()), qd);
  }

  // Residual of constraint k of the cluster: at the last configuration, and at the velocities of the last
  // set_motion.
  Assembly::Residual gap(int k) const { return norm_of(phi_, k); }
  Assembly::Residual rate(int k) const { return norm_of(rate_, k); }

  // Sets the configuration z and its rows; returns the norm of the residuals.
  double residual_norm(const Vector& z) {
    for (std::size_t j = 0; j < free_.size(); ++j) set_position(free_[j], z[j] * unit(free_[j]));
    set_poses();
    set_rows();
    for (int k = 0; k < loop_count(); ++k)
      if (fixes_orientation(loop(k))) align(k);
    return phi_.norm();
  }

 private:
  static bool fixes_orientation(const LoopPlan<double>& at) {
    return at.rows.size() > 3 && is_rotation(at.rows[at.rows.size() - 3]);
  }

  // The three rows u . v = 0 of an orientation also hold after half a turn about an axis. They are therefore
  // replaced by the components of the rotation vector of frame b in frame a.
  [[gnu::noinline]] void align(int k) {
    const LoopPlan<double>& at = loop(k);
    const LoopGeometry<double> g = loop_geometry(at, ws_);
    const std::size_t first = at.rows.size() - 3;
    const auto* rows = &at.rows[first];  // x_a . z_b, y_a . z_b, x_a . y_b (model/loop_rows_of.cpp)
    Mat3<double> a, b;
    a << rows[0].u, rows[1].u, rows[0].u.cross(rows[1].u);
    b << rows[2].v.cross(rows[0].v), rows[2].v, rows[0].v;
    a = g.a.rotation * a;
    b = g.b.rotation * b;
    const RotationVector<double> turn(a.transpose() * b);
    for (int axis = 0; axis < 3; ++axis) {
      const int row = local_row(k, first + static_cast<std::size_t>(axis));
      const Vec3<double> moment = a * turn.moment(Vec3<double>::Unit(axis));
      phi_[row] = turn.value()[axis];
      J_.row(row).setZero();
      add_path(row, at.body_a, {-transposed_product(g.a.rotation, moment), Vec3<double>::Zero()}, 1);
      add_path(row, at.body_b, {transposed_product(g.b.rotation, moment), Vec3<double>::Zero()}, 1);
    }
  }

  static constexpr double dependent = 1e-8;  // relative singular value of J
  static constexpr double rounding_of_rates = 1e-9;
  static constexpr double smallest_damping = 1e-10;
  static constexpr double coarse_damping = 1e-5;    // its square is above rounding errors
  static constexpr double near_enough = 1e-12;      // to the nearest configuration
  static constexpr double on_branch = 1e-10;        // n^T J' v over the squared velocity: rounding error
  static constexpr double branch_residual = 1e-13;  // after the correction

  // Norm over the rows of constraint k, m or rad (rates: per s).
  Assembly::Residual norm_of(const Vector& rows, int k) const {
    if (k >= loop_count()) {
      const CouplingPlan& at = coupling(k - loop_count());
      return {std::abs(rows[local_row(at)]) * row_unit(at), turns(plan_.joints[at.joints.front()])};
    }
    double distance = 0, angle = 0;
    for (std::size_t r = 0; r < loop(k).rows.size(); ++r) {
      const double value = rows[local_row(k, r)];
      (is_rotation(loop(k).rows[r]) ? angle : distance) += value * value;
    }
    return {std::sqrt(angle + row_size_ * row_size_ * distance), angle > distance};
  }
  // Upper bound of the contribution of one path to the rate of a row.
  double largest_rate(int body, Force<double> w, const double* qd) const {
    double sum = 0;
    for (; body != cluster_.root; body = plan_.joints[body].parent) {
      sum += std::abs(qd[body]) *
             std::sqrt(largest_squared(plan_.joints[body], w.moment.squaredNorm(), w.force.squaredNorm()));
      to_parent(plan_.joints[body], ws_.joints[body], w);
    }
    return sum;
  }
  // Rows of couplings are linear, so a long step is possible. Returns the norm of the residuals.
  double go_along_couplings(Vector& z, double norm) {
    const Vector trial = z + LeastNorm(J_, dependent, rounding_).solve(-phi_);
    if (residual_norm(trial) < 0.01 * norm) z = trial;
    return residual_norm(z);
  }

  // Solves P (1 + H) P step = along, H = d(J^T lambda)/dz, P = 1 - J^+ J, by conjugate gradients; stops at a
  // direction of negative curvature (Steihaug 1983).
  Vector newton_step(const Vector& z, const LeastNorm& tangent, const Vector& along, const Vector& lambda) {
    constexpr double difference = 1e-5;
    const Matrix J = J_;
    const auto constraint_force = [&](const Vector& at) -> Vector {
      residual_norm(at);
      return transposed_times(J_, lambda);
    };
    Vector step = Vector::Zero(z.size()), rest = along, direction = along;
    for (int k = 0; k < 2 * z.size() && rest.norm() > 1e-3 * std::min(1.0, along.norm()) * along.norm();
         ++k) {
      const Vector aside = difference / direction.norm() * direction;
      Vector image = direction + (direction.norm() / (2 * difference)) *
                                     (constraint_force(z + aside) - constraint_force(z - aside));
      J_ = J;
      image -= tangent.solve(times(J_, image));
      const double curvature = direction.dot(image);
      if (!(curvature > 0.01 * direction.squaredNorm())) break;
      const double before = rest.squaredNorm();
      step += before / curvature * direction;
      rest -= before / curvature * image;
      direction = rest + rest.squaredNorm() / before * direction;
    }
    return step.norm() > 0 ? step : along;
  }

  // qd + unit x, per joint of the plan.
  std::vector<double> velocities(const double* qd, const Vector& x) const {
    std::vector<double> speed(plan_.joints.size(), 0.0);
    for (int i : joints_) speed[i] = qd[i];
    for (std::size_t j = 0; j < free_.size(); ++j) speed[free_[j]] += x[j] * unit(free_[j]);
    return speed;
  }

  // If rows are dependent, n^T J = 0, the condition J v = 0 is necessary but not sufficient for v to be the
  // velocity of a motion: the second-order condition n^T phi'' = n^T J' v = 0, which does not depend on
  // accelerations, must also hold. It holds on the tangents of the branches that meet in a singular
  // configuration; a motion with other velocities would start with an impact. Corrects `step` to the nearest
  // tangent by Newton's method (minimum norm). Not done with prescribed joints, whose accelerations would
  // enter the condition.
  void move_to_branch(const double* qd, Vector& step) {
    for (int i : joints_)
      if (plan_.joints[i].prescribed) return;
    if (free_.empty()) return;
    const Matrix null = LeastNorm(jacobian_with_held_joints(), dependent, rounding_).left_null_space();
    if (null.cols() == 0) return;
    Vector x = step;
    const std::vector<double> start = velocities(qd, x);
    const double size = squared_norm(start);
    if (null_accelerations(null, start).norm() <= std::max(on_branch, rounding_) * size) return;
    double before = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 50; ++k) {
      const std::vector<double> speed = velocities(qd, x);
      set_motion(speed.data());
      const Vector second_order = null_accelerations(null, speed);
      const double length = std::sqrt(squared_norm(speed));
      if (length == 0) return;
      const double error = std::max(rate_.norm(), second_order.norm() / length) / length;
      if (error <= branch_residual || (error <= rounding_ && !(error < 0.5 * before))) {
        step = x;
        return;
      }
      before = error;
      x -= branch_step(null, qd, x, second_order, length);
    }
  }

  // Newton step of J v = 0, n^T J' v = 0. The second condition is quadratic in v, so central differences give
  // its exact derivative. It is divided by the speed `length`, so that all rows have the same unit.
  Vector branch_step(const Matrix& null, const double* qd, const Vector& x, const Vector& second_order,
                     double length) {
    const auto rows = J_.rows(), n = J_.cols();
    Matrix K(rows + null.cols(), n);
    Vector residual(K.rows());
    residual << rate_, second_order / length;
    K.topRows(rows) = J_;
    for (Eigen::Index j = 0; j < n; ++j) {
      const Vector along = length * Vector::Unit(n, j);
      K.col(j).tail(null.cols()) = (null_accelerations(null, velocities(qd, x + along)) -
                                    null_accelerations(null, velocities(qd, x - along))) /
                                   (2 * length);
    }
    K.bottomRows(null.cols()) /= length;
    return LeastNorm(K, dependent, rounding_).solve(residual);
  }

  // n^T J' v for each column n of `null`.
  Vector null_accelerations(const Matrix& null, const std::vector<double>& qd) {
    set_motion(qd.data());
    if (has_loops()) set_accelerations(qd.data());
    Vector sum = Vector::Zero(null.cols());
    for (int k = 0; k < cluster_.loop_count; ++k) {
      const LoopGeometry<double> g = loop_geometry(loop(k), ws_);
      for (std::size_t r = 0; r < loop(k).rows.size(); ++r) {
        const RowValues<double> values = row_values(g, loop(k).rows[r]);
        const double acceleration = values.quadratic + row_acceleration(values.on_a, g.a, loop(k).body_a) +
                                    row_acceleration(values.on_b, g.b, loop(k).body_b);
        for (Eigen::Index n = 0; n < null.cols(); ++n)
          sum[n] += null(local_row(k, r), n) * acceleration / row_unit(loop(k).rows[r]);
      }
    }
    return sum;
  }

  // Sets the accelerations of the bodies at qdd = 0 relative to the cluster's root. Call after set_motion.
  void set_accelerations(const double* qd) {
    acceleration_.resize(plan_.joints.size());
    for (int i : joints_) {
      const int parent = plan_.joints[i].parent;
      const GroundState<double>& from = parent_of(i);
      const Vec3<double> arm = ws_.ground[i].position - from.position, zero = Vec3<double>::Zero();
      const Vec3<double> turned = from.omega.cross(ws_.ground[i].rotation.col(2) * qd[i]);
      const Motion<double> carried =
          parent == cluster_.root ? Motion<double>{zero, zero} : acceleration_[parent];
      acceleration_[i].angular = carried.angular;
      acceleration_[i].linear =
          carried.linear + carried.angular.cross(arm) + from.omega.cross(from.omega.cross(arm));
      add_velocity_product(plan_.joints[i], turned, acceleration_[i]);
    }
  }

  // The part of phi'' due to the acceleration of one body: the wrench of the row on the body times the
  // acceleration.
  double row_acceleration(const Force<double>& on_body, const GroundState<double>& at, int body) const {
    if (body == cluster_.root) return 0;
    return on_body.moment.dot(at.rotation.transpose() * acceleration_[body].angular) +
           on_body.force.dot(at.rotation.transpose() * acceleration_[body].linear);
  }

  double squared_norm(const std::vector<double>& qd) const {
    double sum = 0;
    for (int i : joints_) sum += qd[i] * qd[i] / (unit(i) * unit(i));
    return sum;
  }

  // J including the columns of held joints, which may accelerate.
  Matrix jacobian_with_held_joints() {
    const std::vector<int> free = free_, column = column_;
    const Matrix J = J_;
    free_ = joints_;
    for (std::size_t j = 0; j < joints_.size(); ++j) column_[joints_[j]] = static_cast<int>(j);
    J_.resize(J.rows(), static_cast<Eigen::Index>(joints_.size()));
    set_rows();
    const Matrix all = J_;
    free_ = free;
    column_ = column;
    J_ = J;
    return all;
  }

  const Model& model_;
  Vector z_start_;
  double fastest_ = 1;                        // maximum velocity so far, rad/s or sizes/s
  std::vector<Motion<double>> acceleration_;  // in ground axes
};

}  // namespace redysim
