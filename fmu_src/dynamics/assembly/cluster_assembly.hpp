#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "dynamics/loops/cluster_rows.hpp"
#include "math/least_norm.hpp"

namespace redysim {

// Brings one cluster from its start values to the nearest configuration and velocities that its rows allow.
class ClusterAssembly : public ClusterRows<double> {
 public:
  using Vector = Eigen::VectorXd;
  using Matrix = Eigen::MatrixXd;

  // All relative to the size of the mechanism, or rad.
  static constexpr double closed_already = 2e-15;  // rounding: such a pose is left as it is
  static constexpr double closed_enough = 1e-10;

  using ClusterRows::ClusterRows;

  // Takes the initial configuration, measures the mechanism and returns the constraint violation.
  double start(const double* q) {
    set_pose(q);
    measure();
    z_start_.resize(static_cast<Eigen::Index>(free_.size()));
    for (std::size_t j = 0; j < free_.size(); ++j) z_start_[j] = q[free_[j]] / unit(free_[j]);
    return open(z_start_);
  }

  const Vector& z_start() const { return z_start_; }

  // Levenberg-Marquardt steps, damped by the distance itself: quadratic at regular poses, steady at singular
  // ones. Returns what stays open.
  double close(Vector& z) {
    double norm = open(z);
    double damping_factor = 1;
    int idle = 0;
    for (int k = 0; k < 100 && norm > closed_already && idle < 3; ++k) {
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
        const double there = open(trial);
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
    open(z);
    return norm;
  }

  // From a configuration that satisfies the loops to the one nearest to the start: Newton steps in the
  // tangent plane.
  void approach(Vector& z) {
    double distance = (z - z_start_).norm(), gradient = 0;
    for (int k = 0; k < 60; ++k) {
      open(z);
      const LeastNorm tangent(J_, dependent, rounding_);
      const Vector away = z_start_ - z;
      const Vector along = away - tangent.solve(opened_by(away));
      if (along.norm() < near_enough * std::max(1.0, distance) || (gradient > 0 && along.norm() > gradient))
        break;
      const Vector step = newton_step(z, tangent, along, tangent.solve_transposed(away));
      // near the end distances differ by rounding: there the gradient tells
      const bool at_the_end = step.norm() < 1e-4;
      gradient = at_the_end ? along.norm() : 0;
      bool nearer = false;
      for (double part = 1; part > 0.01 && !nearer; part *= 0.5) {
        Vector trial = z + part * step;
        if (close(trial) > closed_enough) continue;
        const double there = (trial - z_start_).norm();
        nearer = at_the_end || there < distance * (1 - 1e-12);
        if (nearer) {
          z = trial;
          distance = there;
        }
      }
      if (!nearer) break;
    }
    open(z);
  }

  // All of the rows, and the fastest joint so far.
  void set_motion(const double* qd) {
    const GroundState<double> root = ground_state(ws_, cluster_.root);
    fastest_ = std::max({fastest_, root.omega.norm(), root.velocity.norm() / size_});
    for (int i : joints_) fastest_ = std::max(fastest_, std::abs(qd[i]) / unit(i));
    ClusterRows::set_motion(qd);
  }

  // The nearest velocities on the loops, after set_motion(qd).
  void align(const double* qd, std::vector<double>& change) {
    Vector step = Vector::Zero(static_cast<Eigen::Index>(free_.size()));
    if (rate_.lpNorm<Eigen::Infinity>() > 0 && !free_.empty())
      step = LeastNorm(J_, dependent, rounding_).solve(-rate_);
    take_a_branch(qd, step);
    for (std::size_t j = 0; j < free_.size(); ++j) change[free_[j]] = step[j] * unit(free_[j]);
  }

  // Whether the rates of a loop, after set_motion(qd), are rounding against what single joints make of them.
  bool keeps_closed(int k, const double* qd) const {
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

  // Residual of a loop of the cluster at the last pose, and at the velocities of the last set_motion.
  Assembly::Residual gap(int k) const { return norm_of(phi_, k); }
  Assembly::Residual rate(int k) const { return norm_of(rate_, k); }

  // Residuals at z; returns their norm.
  double open(const Vector& z) {
    for (std::size_t j = 0; j < free_.size(); ++j)
      set_joint_position(plan_.joints[free_[j]], z[j] * unit(free_[j]), ws_.joints[free_[j]]);
    set_poses();
    set_rows();
    return phi_.norm();
  }

 private:
  static constexpr double dependent = 1e-8;  // rows of J below this part of the largest pivot
  static constexpr double rounding_of_rates = 1e-9;
  static constexpr double smallest_damping = 1e-10;
  static constexpr double coarse_damping = 1e-5;  // its square is no rounding
  static constexpr double near_enough = 1e-12;    // to the nearest pose
  static constexpr double on_a_branch = 1e-10;    // bends by less, over the squared speed: rounding
  static constexpr double closes_again = 1e-13;   // after the search for a branch

  // Over the rows of a loop, in m or rad.
  Assembly::Residual norm_of(const Vector& rows, int k) const {
    double distance = 0, angle = 0;
    for (std::size_t r = 0; r < loop(k).rows.size(); ++r) {
      const double value = rows[local_row(k, r)];
      (is_rotation(loop(k).rows[r]) ? angle : distance) += value * value;
    }
    return {std::sqrt(angle + row_size_ * row_size_ * distance), angle > distance};
  }
  // What the joints of one path can make of a row's rate, each at its best.
  double largest_rate(int body, Force<double> w, const double* qd) const {
    double sum = 0;
    for (; body != cluster_.root; body = plan_.joints[body].parent) {
      sum += std::abs(qd[body]) *
             std::sqrt(largest_squared(plan_.joints[body], w.moment.squaredNorm(), w.force.squaredNorm()));
      to_parent(plan_.joints[body], ws_.joints[body], w);
    }
    return sum;
  }
  // J x
  Vector opened_by(const Vector& x) const {
    Vector rates = Vector::Zero(J_.rows());
    for (Eigen::Index k = 0; k < J_.cols(); ++k) rates += x[k] * J_.col(k);
    return rates;
  }

  // Solves P (1 + H) P step = along, H = d(J^T lambda)/dz, by conjugate gradients; where the curvature is not
  // positive it stops with what it has (Steihaug 1983).
  Vector newton_step(const Vector& z, const LeastNorm& tangent, const Vector& along, const Vector& lambda) {
    constexpr double difference = 1e-5;
    const Matrix J = J_;
    const auto pull = [&](const Vector& at) -> Vector {
      open(at);
      return J_.transpose().lazyProduct(lambda);
    };
    Vector step = Vector::Zero(z.size()), rest = along, direction = along;
    for (int k = 0; k < 2 * z.size() && rest.norm() > 1e-3 * std::min(1.0, along.norm()) * along.norm();
         ++k) {
      const Vector aside = difference / direction.norm() * direction;
      Vector image = direction + (direction.norm() / (2 * difference)) * (pull(z + aside) - pull(z - aside));
      J_ = J;
      image -= tangent.solve(opened_by(image));
      const double curvature = direction.dot(image);
      if (!(curvature > 0.01 * direction.squaredNorm())) break;
      const double before = rest.squaredNorm();
      step += before / curvature * direction;
      rest -= before / curvature * image;
      direction = rest + rest.squaredNorm() / before * direction;
    }
    return step.norm() > 0 ? step : along;
  }

  // Where rows are dependent, n^T J = 0, a velocity that keeps J v = 0 need not be one of a motion: also
  // n^T phi'' = n^T (dJ/dt v) = 0 must hold, whatever the accelerations. That is so on the tangents of the
  // branches that meet in a singular pose, and on no other; motion off them would begin with an impact. Adds
  // to `step` the way to one of them (Newton, least norm; what phi'' has of v is quadratic, so its derivative
  // is a difference). Prescribed accelerations would count as well: there nothing is done.
  void take_a_branch(const double* qd, Vector& step) {
    for (int i : joints_)
      if (plan_.joints[i].prescribed) return;
    if (free_.empty()) return;
    const Matrix null = LeastNorm(jacobian_of_all(), dependent, rounding_).left_null_space();
    if (null.cols() == 0) return;
    std::vector<double> speed(plan_.joints.size(), 0.0);
    const auto at = [&](const Vector& x) -> double* {
      for (int i : joints_) speed[i] = qd[i];
      for (std::size_t j = 0; j < free_.size(); ++j) speed[free_[j]] += x[j] * unit(free_[j]);
      return speed.data();
    };
    Vector x = step;
    const double size = squared(at(x));
    if (bend(null, at(x)).norm() <= on_a_branch * size) return;
    const auto rows = J_.rows(), bends = null.cols(), n = J_.cols();
    Matrix K(rows + bends, n);
    Vector open(rows + bends);
    for (int k = 0; k < 50; ++k) {
      set_motion(at(x));
      const Vector bent = bend(null, at(x));
      const double length = std::sqrt(squared(at(x)));
      open << rate_, bent;
      if (length == 0) return;
      if (rate_.norm() <= closes_again * length && bent.norm() <= closes_again * length * length) {
        step = x;
        return;
      }
      K.topRows(rows) = J_;
      for (Eigen::Index j = 0; j < n; ++j) {
        const Vector along = length * Vector::Unit(n, j);
        K.col(j).tail(bends) = (bend(null, at(x + along)) - bend(null, at(x - along))) / (2 * length);
      }
      // rows of one size: speeds, and bends over the speed
      K.bottomRows(bends) /= length;
      open.tail(bends) /= length;
      x -= LeastNorm(K, dependent, rounding_).solve(open);
    }
  }

  // n^T dJ/dt v, per column of `null`.
  Vector bend(const Matrix& null, const double* qd) {
    set_motion(qd);
    set_accelerations(qd);
    Vector bent = Vector::Zero(null.cols());
    for (int k = 0; k < cluster_.loop_count; ++k) {
      const LoopGeometry<double> g = loop_geometry(loop(k), ws_);
      for (std::size_t r = 0; r < loop(k).rows.size(); ++r) {
        const RowValues<double> values = row_values(g, loop(k).rows[r]);
        const double second = values.quadratic + served(values.on_a, g.a, loop(k).body_a) +
                              served(values.on_b, g.b, loop(k).body_b);
        for (Eigen::Index n = 0; n < null.cols(); ++n)
          bent[n] += null(local_row(k, r), n) * second / row_unit(loop(k).rows[r]);
      }
    }
    return bent;
  }

  // Accelerations of the bodies while no joint accelerates; the cluster's root has none. Uses set_motion.
  void set_accelerations(const double* qd) {
    acceleration_.resize(plan_.joints.size());
    for (int i : joints_) {
      const int parent = plan_.joints[i].parent;
      const GroundState<double> from = ground_state(ws_, parent);
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

  // What a body's acceleration adds to that of a row that pulls on it.
  double served(const Force<double>& on_body, const GroundState<double>& at, int body) const {
    if (body == cluster_.root) return 0;
    return on_body.moment.dot(at.rotation.transpose() * acceleration_[body].angular) +
           on_body.force.dot(at.rotation.transpose() * acceleration_[body].linear);
  }

  double squared(const double* qd) const {
    double sum = 0;
    for (int i : joints_) sum += qd[i] * qd[i] / (unit(i) * unit(i));
    return sum;
  }

  // J with the columns of held joints as well: they may accelerate.
  Matrix jacobian_of_all() {
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

  Vector z_start_;
  double fastest_ = 1;                        // joint so far, rad/s or sizes/s
  std::vector<Motion<double>> acceleration_;  // along the ground's axes
};

}  // namespace redysim
