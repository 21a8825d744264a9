#include "dynamics/assembly/assembly_tangent.hpp"

#include <cmath>

#include "dynamics/loops/cluster_rows.hpp"
#include "math/least_norm.hpp"

// The assembled start solves, in units of the joints, x = q / unit, A = J unit of the free joints,
//   W (x - x0) + A^T lambda = 0,  phi(x) = 0     and then        W (v - v0) + A^T mu = 0,  A v + rates of
//   held = 0.
// W = 1, but for slides it changes with the size s of the start pose: dW = -2 ds/s. Derived along a
// direction, with P = 1 - A^+ A and held joints (hold, prescribed) going their own way:
//   P (1 + H) dx = P (dx0 - dW (x - x0) - dA^T lambda of held),  A dx = -J_held dq_held,   H dx = dA^T lambda
//   along dx dv = P (dv0 - dW (v - v0) - dA^T mu) - A^+ (dJ qd + J_held dqd_held)

namespace redysim {
namespace {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

constexpr double dependent = 1e-8;  // as assemble(...) has it
constexpr double moved_by_nothing = 1e-12;
constexpr double agrees = 1e-6;    // the rest that the loops leave of a direction
constexpr double rounding = 1e-9;  // of directions that the loops let pass

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
    Directions change(q_.size(), 0.0), speed(q_.size(), 0.0);  // of held joints, then of all
    bool any = false;
    for (int i : rows_.joints()) {
      change[i] = q_[i].derivative;
      speed[i] = qd_[i].derivative;
      any = any || change[i] != 0 || speed[i] != 0;
    }
    if (!any) return nullptr;
    const Vector wanted = in_units(change) - weight_change(moved_),
                 wanted_speed = in_units(speed) - weight_change(sped_);
    put(Vector::Zero(wanted.size()), change);
    put(Vector::Zero(wanted.size()), speed);

    set_pose(Directions(q_.size(), 0.0));
    A_ = values(rows_.jacobian());
    const LeastNorm inverse(A_, dependent, rows_.rounding());
    const auto along = [&](const Vector& x) -> Vector { return x - inverse.solve(A_.lazyProduct(x)); };
    if (is_singular(inverse, along)) return "the initial configuration is singular";

    const Vector opened = opened_by(change);
    Vector dx = along(wanted) - inverse.solve(opened);
    if (moved_.norm() > moved_by_nothing) {
      const Vector lambda = -inverse.solve_transposed(moved_), particular = -inverse.solve(opened);
      put(particular, change);
      const Vector lacking = along(wanted - particular - turned(change, lambda));
      dx =
          particular + along(LeastNorm(curvature(along, lambda), dependent, rows_.rounding()).solve(lacking));
    }
    put(dx, change);
    const double length = dx.norm() + wanted.norm();
    if (opened_by(change).norm() > agrees * opened.norm() + rounding * length) return overconstrained;

    const Vector pushed = turned(change, -inverse.solve_transposed(sped_));
    const Vector rates = rates_by(change, speed);
    const Vector dv = along(wanted_speed - pushed) - inverse.solve(rates);
    put(dv, speed);
    if (rates_by(change, speed).norm() >
        agrees * rates.norm() + rounding * (dv.norm() + wanted_speed.norm() + (1 + pace()) * length))
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
  void put(const Vector& x, Directions& to) const {
    for (std::size_t k = 0; k < free_.size(); ++k) to[free_[k]] = x[k] * rows_.unit(free_[k]);
  }

  // The velocity of the start, in units.
  double pace() const {
    double squared = 0;
    for (int i : rows_.joints()) squared += std::pow(qd_[i].value / rows_.unit(i), 2);
    return std::sqrt(squared);
  }

  // The size of the mechanism and how it changes with the start pose.
  void measure_start(const Assembly& assembly) {
    std::vector<Dual> start = q_;
    for (int i : rows_.joints()) start[i].value -= assembly.moved[i];
    rows_.set_pose(start.data());
    const Dual size = rows_.measure();
    growth_ = size.derivative / size.value;  // no number where lengths are those of bodies
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
  Vector opened_by(const Directions& change) {
    set_pose(change);
    return derivatives(rows_.residuals());
  }
  // dA^T y along `change`
  Vector turned(const Directions& change, const Vector& y) {
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
      put(direction, change);
      result.col(k) = along(direction + turned(change, lambda)) + Vector::Unit(n, k) - direction;
    }
    return result;
  }

  // Whether rows that depend on others here are independent of them nearby, n^T dA P != 0 along the loops:
  // there branches meet, and the nearest pose has no derivative.
  template <class Projection>
  bool is_singular(const LeastNorm& inverse, const Projection& along) {
    const Matrix null = inverse.left_null_space();
    if (null.cols() == 0 || free_.empty()) return false;
    Vector some(static_cast<Eigen::Index>(free_.size()));
    for (Eigen::Index k = 0; k < some.size(); ++k) some[k] = std::sin(1.0 + static_cast<double>(k));
    Directions change(q_.size(), 0.0);
    put(along(some), change);
    for (Eigen::Index k = 0; k < null.cols(); ++k)
      if (along(turned(change, null.col(k))).norm() > agrees) return true;
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
  // the roots of the clusters; their motion moves no row
  std::vector<Dual> pose(q.size()), rest(q.size());
  for (std::size_t i = 0; i < q.size(); ++i) pose[i] = Dual(q[i].value);
  set_positions(plan, ws, pose.data());
  set_ground_motion(plan, ws, rest.data());
  for (const ClusterPlan& cluster : plan.clusters)
    if (const char* why = ClusterDirection(model, assembly, plan, ws, cluster, q, qd).follow()) return why;
  return nullptr;
}

}  // namespace redysim
