#include "dynamics/assembly/assembly_tangent.hpp"

#include <cmath>

#include "dynamics/loops/cluster_rows.hpp"
#include "math/least_norm.hpp"

// The assembled start values solve, in units of the joints, x = q / unit, A = J unit of the free joints,
//   W (x - x0) + A^T lambda = 0,  phi(x) = 0,
//   W (v - v0) + A^T mu = 0,      A v + (rates due to held joints) = 0
// with W = 1. The unit of prismatic joints changes with the size s of the start configuration: dW = -2 ds/s.
// Directional derivative, with P = 1 - A^+ A and given directions of the held joints (hold, prescribed):
//   P (1 + H) dx = P (dx0 - dW (x - x0) - (dA^T lambda due to held joints)),  A dx = -J_held dq_held
//   dv = P (dv0 - dW (v - v0) - dA^T mu) - A^+ (dJ qd + J_held dqd_held)
// where H dx is dA^T lambda along dx.

namespace redysim {
namespace {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

constexpr double dependent = 1e-8;  // relative singular value of J, as in assemble(...)
constexpr double not_moved = 1e-12;
constexpr double agreement = 1e-6;  // relative remainder of a direction that the loops prevent
constexpr double rounding = 1e-9;   // relative error of directions that satisfy the loops

class ClusterDirection {
 public:
  ClusterDirection(const Model& model, const Assembly& assembly, const Plan<Dual>& plan, Workspace<Dual>& ws,
                   const ClusterPlan& cluster, std::vector<Dual>& q, std::vector<Dual>& qd)
      : plan_(plan), rows_(model, plan, ws, cluster), free_(rows_.free_joints()), q_(q), qd_(qd) {
    measure_start(assembly);
    moved_ = in_units(assembly.moved);
    sped_ = in_units(assembly.sped);
  }

  const char* follow() {
    Directions change(q_.size(), 0.0), speed(q_.size(), 0.0);  // first of the held joints, then of all joints
    bool any = false;
    for (int i : rows_.joints()) {
      change[i] = q_[i].derivative;
      speed[i] = qd_[i].derivative;
      any = any || change[i] != 0 || speed[i] != 0;
    }
    if (!any) return nullptr;
    const Vector wanted = in_units(change) - weight_change(moved_),
                 wanted_speed = in_units(speed) - weight_change(sped_);
    set_free(Vector::Zero(wanted.size()), change);
    set_free(Vector::Zero(wanted.size()), speed);

    set_pose(Directions(q_.size(), 0.0));
    A_ = values(rows_.jacobian());
    const LeastNorm inverse(A_, dependent, rows_.rounding());
    const auto along = [&](const Vector& x) -> Vector { return x - inverse.solve(times(A_, x)); };
    if (is_singular(inverse, along)) return "the initial configuration is singular";

    const Vector of_held = residual_change(change);
    Vector dx = along(wanted) - inverse.solve(of_held);
    if (moved_.norm() > not_moved) {
      const Vector lambda = -inverse.solve_transposed(moved_), particular = -inverse.solve(of_held);
      set_free(particular, change);
      const Vector remaining = along(wanted - particular - constraint_force_change(change, lambda));
      dx = particular +
           along(LeastNorm(curvature(along, lambda), dependent, rows_.rounding()).solve(remaining));
    }
    set_free(dx, change);
    const double length = dx.norm() + wanted.norm();
    if (residual_change(change).norm() > agreement * of_held.norm() + rounding * length)
      return overconstrained;

    const Vector force_change = constraint_force_change(change, -inverse.solve_transposed(sped_));
    const Vector rates = rates_by(change, speed);
    const Vector dv = along(wanted_speed - force_change) - inverse.solve(rates);
    set_free(dv, speed);
    if (rates_by(change, speed).norm() >
        agreement * rates.norm() + rounding * (dv.norm() + wanted_speed.norm() + (1 + speed_norm()) * length))
      return overconstrained;
    for (int i : rows_.joints()) {
      q_[i].derivative = change[i];
      qd_[i].derivative = speed[i];
    }
    return nullptr;
  }

 private:
  using Directions = std::vector<double>;  // per joint of the plan
  static constexpr const char* overconstrained = "held and prescribed joints leave the loops no such motion";

  static Matrix values(const Eigen::Matrix<Dual, Eigen::Dynamic, Eigen::Dynamic>& of) {
    Matrix result(of.rows(), of.cols());
    for (Eigen::Index k = 0; k < of.size(); ++k) result.data()[k] = of.data()[k].value;
    return result;
  }
  static Vector derivatives(const Eigen::Matrix<Dual, Eigen::Dynamic, 1>& of) {
    Vector result(of.size());
    for (Eigen::Index k = 0; k < of.size(); ++k) result[k] = of[k].derivative;
    return result;
  }
  Vector in_units(const Directions& of) const {
    Vector x(static_cast<Eigen::Index>(free_.size()));
    for (std::size_t k = 0; k < free_.size(); ++k) x[k] = of[free_[k]] / rows_.unit(free_[k]);
    return x;
  }
  void set_free(const Vector& x, Directions& to) const {
    for (std::size_t k = 0; k < free_.size(); ++k) to[free_[k]] = x[k] * rows_.unit(free_[k]);
  }

  // Norm of the start velocity in units of the joints.
  double speed_norm() const {
    double squared = 0;
    for (int i : rows_.joints()) squared += std::pow(qd_[i].value / rows_.unit(i), 2);
    return std::sqrt(squared);
  }

  // Measures the mechanism's size and its derivative along the direction of the start configuration.
  void measure_start(const Assembly& assembly) {
    std::vector<Dual> start = q_;
    for (int i : rows_.joints()) start[i].value -= assembly.moved[i];
    rows_.set_pose(start.data());
    const Dual size = rows_.measure();
    growth_ = size.derivative / size.value;  // NaN if the unit is the size of the bodies
  }
  // dW x
  Vector weight_change(const Vector& x) const {
    Vector result = Vector::Zero(x.size());
    for (std::size_t k = 0; k < free_.size(); ++k)
      if (!turns(plan_.joints[free_[k]]) && x[k] != 0) result[k] = -2 * growth_ * x[k];
    return result;
  }

  void set_pose(const Directions& change) {
    std::vector<Dual> q = q_;
    for (int i : rows_.joints()) q[i].derivative = change[i];
    rows_.set_pose(q.data());
    rows_.set_rows();
  }
  // J change
  Vector residual_change(const Directions& change) {
    set_pose(change);
    return derivatives(rows_.residuals());
  }
  // dA^T y along `change`
  Vector constraint_force_change(const Directions& change, const Vector& y) {
    set_pose(change);
    const auto& J = rows_.jacobian();
    Vector result = Vector::Zero(J.cols());
    for (Eigen::Index k = 0; k < J.cols(); ++k)
      for (Eigen::Index row = 0; row < J.rows(); ++row) result[k] += J(row, k).derivative * y[row];
    return result;
  }
  // dJ qd + J speed, dJ along `change`
  Vector rates_by(const Directions& change, const Directions& speed) {
    set_pose(change);
    std::vector<Dual> qd = qd_;
    for (int i : rows_.joints()) qd[i].derivative = speed[i];
    rows_.set_motion(qd.data());
    return derivatives(rows_.rates());
  }
  // P (1 + H) P + (1 - P), of full rank
  template <class Projection>
  Matrix curvature(const Projection& along, const Vector& lambda) {
    const auto n = static_cast<Eigen::Index>(free_.size());
    Matrix result(n, n);
    Directions change(q_.size(), 0.0);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Vector direction = along(Vector::Unit(n, k));
      set_free(direction, change);
      result.col(k) =
          along(direction + constraint_force_change(change, lambda)) + Vector::Unit(n, k) - direction;
    }
    return result;
  }

  // Whether rows that are dependent here are independent nearby, n^T dA P != 0: then branches meet, and the
  // nearest configuration has no derivative.
  template <class Projection>
  bool is_singular(const LeastNorm& inverse, const Projection& along) {
    const Matrix null = inverse.left_null_space();
    if (null.cols() == 0 || free_.empty()) return false;
    Vector some(static_cast<Eigen::Index>(free_.size()));
    for (Eigen::Index k = 0; k < some.size(); ++k) some[k] = std::sin(1.0 + static_cast<double>(k));
    Directions change(q_.size(), 0.0);
    set_free(along(some), change);
    for (Eigen::Index k = 0; k < null.cols(); ++k)
      if (along(constraint_force_change(change, null.col(k))).norm() > agreement) return true;
    return false;
  }

  const Plan<Dual>& plan_;
  ClusterRows<Dual> rows_;
  const std::vector<int>& free_;
  std::vector<Dual>&q_, &qd_;
  double growth_ = 0;  // ds / s
  Vector moved_, sped_;
  Matrix A_;
};

}  // namespace

const char* follow_assembly(const Model& model, const Assembly& assembly, const Plan<Dual>& plan,
                            Workspace<Dual>& ws, std::vector<Dual>& q, std::vector<Dual>& qd) {
  // poses of the clusters' roots; the rows do not depend on these
  std::vector<Dual> pose(q.size()), rest(q.size());
  for (std::size_t i = 0; i < q.size(); ++i) pose[i] = Dual(q[i].value);
  set_positions(plan, ws, pose.data());
  set_ground_motion(plan, ws, rest.data());
  for (const ClusterPlan& cluster : plan.clusters)
    if (const char* why = ClusterDirection(model, assembly, plan, ws, cluster, q, qd).follow()) return why;
  return nullptr;
}

}  // namespace redysim
