#include "dynamics/assembly_tangent.hpp"

#include "dynamics/bias.hpp"
#include "dynamics/loop_rows.hpp"
#include "math/least_norm.hpp"

// The assembled start solves, in units of the joints, z = q / unit, A = J unit of the free joints,
//   z - z0 + A^T lambda = 0,  phi(z) = 0        and then        v - v0 + A^T mu = 0,  A v + rates of held =
//   0.
// Derived along a direction, with P = 1 - A^+ A and held joints (hold, prescribed) going their own way:
//   P (1 + H) dz = P (dz0 - dA^T lambda of held),  A dz = -J_held dq_held,      H dz = dA^T lambda along dz
//   dv = P (dv0 - dA^T mu) - A^+ (dJ qd + J_held dqd_held)

namespace redysim {
namespace {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

constexpr double dependent = 1e-8;  // as assemble(...) has it
constexpr double moved_by_nothing = 1e-12;

class Direction {
 public:
  Direction(const Model& model, const Assembly& assembly, const Plan<Dual>& plan, Workspace<Dual>& ws,
            std::vector<Dual>& q, std::vector<Dual>& qd)
      : plan_(plan), ws_(ws), q_(q), qd_(qd), unit_(assembly.unit), rows_(ws.loop.rate.size()) {
    for (const ClusterPlan& cluster : plan.clusters)
      for (int i : cluster.joints) {
        const bool held = model.links[plan.joints[i].link].joint.hold || plan.joints[i].prescribed;
        (held ? held_ : free_).push_back(i);
      }
    set_jacobian(std::vector<double>(q.size(), 0.0));
    A_ = J_;
  }

  void follow(const Assembly& assembly) {
    const LeastNorm inverse(A_, dependent);
    const auto along = [&](const Vector& x) -> Vector { return x - inverse.solve(A_.lazyProduct(x)); };
    const LeastNorm transposed(A_.transpose(), dependent);
    const Vector lambda = transposed.solve(-moved(assembly.moved)),
                 mu = transposed.solve(-moved(assembly.sped));

    std::vector<double> change(q_.size(), 0.0);
    for (int i : held_) change[i] = q_[i].derivative;
    const Vector wanted = start(q_);
    Vector dz = wanted;
    if (moved(assembly.moved).norm() > moved_by_nothing) {
      const Vector particular = -inverse.solve(rate_of(change));
      put(particular, change);
      const Vector lacking = along(wanted - particular - curvature(change, lambda));
      dz = particular + along(LeastNorm(along_curvature(along, lambda), dependent).solve(lacking));
    } else {
      dz = along(wanted) - inverse.solve(rate_of(change));
    }
    put(dz, change);

    const Vector turned = curvature(change, mu);  // and dJ qd, the rate's change
    for (std::size_t i = 0; i < q_.size(); ++i) q_[i].derivative = change[i];
    std::vector<double> speed(q_.size(), 0.0);
    for (int i : held_) speed[i] = qd_[i].derivative;
    const Vector open = rate_change() + rate_of(speed);
    put(along(start(qd_) - turned) - inverse.solve(open), speed);
    for (int i : free_) qd_[i].derivative = speed[i];
  }

 private:
  // Free joints' directions, in units.
  Vector start(const std::vector<Dual>& of) const {
    Vector x(static_cast<Eigen::Index>(free_.size()));
    for (std::size_t k = 0; k < free_.size(); ++k) x[k] = of[free_[k]].derivative / unit_[free_[k]];
    return x;
  }
  Vector moved(const std::vector<double>& by) const {
    Vector x(static_cast<Eigen::Index>(free_.size()));
    for (std::size_t k = 0; k < free_.size(); ++k) x[k] = by[free_[k]] / unit_[free_[k]];
    return x;
  }
  void put(const Vector& x, std::vector<double>& to) const {
    for (std::size_t k = 0; k < free_.size(); ++k) to[free_[k]] = x[k] * unit_[free_[k]];
  }

  void set_rows(const std::vector<double>& change, const std::vector<Dual>& speed) {
    std::vector<Dual> q = q_;
    for (std::size_t i = 0; i < q.size(); ++i) q[i].derivative = change[i];
    set_positions(plan_, ws_, q.data());
    set_ground_motion(plan_, ws_, speed.data());
    set_loop_residuals(plan_, ws_);
  }

  // J and its change along `change`, columns of the free joints in units.
  void set_jacobian(const std::vector<double>& change) {
    J_.resize(static_cast<Eigen::Index>(rows_), static_cast<Eigen::Index>(free_.size()));
    dJ_ = J_;
    std::vector<Dual> speed(q_.size());
    for (std::size_t k = 0; k < free_.size(); ++k) {
      speed[free_[k]] = Dual(unit_[free_[k]]);
      set_rows(change, speed);
      for (std::size_t row = 0; row < rows_; ++row) {
        J_(row, k) = ws_.loop.rate[row].value;
        dJ_(row, k) = ws_.loop.rate[row].derivative;
      }
      speed[free_[k]] = Dual(0);
    }
  }
  // dA^T lambda along `change`.
  Vector curvature(const std::vector<double>& change, const Vector& lambda) {
    set_jacobian(change);
    return dJ_.transpose().lazyProduct(lambda);
  }
  // P (1 + H) P + (1 - P), of full rank
  template <class Projection>
  Matrix along_curvature(const Projection& along, const Vector& lambda) {
    const auto n = static_cast<Eigen::Index>(free_.size());
    Matrix result(n, n);
    std::vector<double> change(q_.size(), 0.0);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Vector direction = along(Vector::Unit(n, k));
      put(direction, change);
      result.col(k) = along(direction + curvature(change, lambda)) + Vector::Unit(n, k) - direction;
    }
    return result;
  }
  // J speed of all joints.
  Vector rate_of(const std::vector<double>& speed) {
    std::vector<Dual> duals(speed.begin(), speed.end());
    set_rows(std::vector<double>(q_.size(), 0.0), duals);
    Vector rate(static_cast<Eigen::Index>(rows_));
    for (std::size_t row = 0; row < rows_; ++row) rate[row] = ws_.loop.rate[row].value;
    return rate;
  }
  // dJ qd along the directions in q_.
  Vector rate_change() {
    std::vector<double> change;
    std::vector<Dual> speed;
    for (std::size_t i = 0; i < q_.size(); ++i) {
      change.push_back(q_[i].derivative);
      speed.push_back(Dual(qd_[i].value));
    }
    set_rows(change, speed);
    Vector rate(static_cast<Eigen::Index>(rows_));
    for (std::size_t row = 0; row < rows_; ++row) rate[row] = ws_.loop.rate[row].derivative;
    return rate;
  }

  const Plan<Dual>& plan_;
  Workspace<Dual>& ws_;
  std::vector<Dual>&q_, &qd_;
  const std::vector<double>& unit_;
  std::size_t rows_;
  std::vector<int> free_, held_;  // of the clusters
  Matrix J_, dJ_, A_;
};

}  // namespace

void follow_assembly(const Model& model, const Assembly& assembly, const Plan<Dual>& plan,
                     Workspace<Dual>& ws, std::vector<Dual>& q, std::vector<Dual>& qd) {
  if (plan.has_loops() && !assembly.moved.empty())
    Direction(model, assembly, plan, ws, q, qd).follow(assembly);
}

}  // namespace redysim
