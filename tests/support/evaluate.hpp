#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "dynamics/aba.hpp"
#include "dynamics/crba.hpp"
#include "dynamics/energy.hpp"
#include "dynamics/rnea.hpp"
#include "math/dual.hpp"

// The algorithms as functions from vectors to vectors, with a workspace of their own.

namespace redysim::test {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

template <class Scalar>
using VectorOf = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

inline Vector vector_of(const std::vector<double>& v) {
  return Eigen::Map<const Vector>(v.data(), static_cast<Eigen::Index>(v.size()));
}

// x + eps dx
inline VectorOf<Dual> dual(const Vector& x, const Vector& dx) {
  VectorOf<Dual> out(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) out[i] = Dual(x[i], dx[i]);
  return out;
}
inline Vector derivative(const VectorOf<Dual>& x) {
  Vector out(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) out[i] = x[i].derivative;
  return out;
}

template <class Scalar>
struct Evaluate {
  using V = VectorOf<Scalar>;
  Plan<Scalar> plan;
  Workspace<Scalar> ws;

  explicit Evaluate(const Model& model) : plan(model), ws(plan) {}

  int nv() const { return plan.nv; }

  V qdd(const V& q, const V& qd, const V& tau) {
    V out(plan.nv);
    forward_dynamics(plan, ws, q.data(), qd.data(), tau.data(), out.data());
    return out;
  }
  V tau(const V& q, const V& qd, const V& qdd) {
    V out(plan.nv);
    inverse_dynamics(plan, ws, q.data(), qd.data(), qdd.data(), out.data());
    return out;
  }
  Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> inertia(const V& q) {
    Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> M(plan.nv, plan.nv);
    joint_space_inertia<Scalar>(plan, ws, q.data(), M);
    return M;
  }
  Scalar kinetic(const V& q, const V& qd) { return kinetic_energy(plan, ws, q.data(), qd.data()); }
  Scalar potential(const V& q, const V& qd) { return potential_energy(plan, ws, q.data(), qd.data()); }
  Scalar power(const V& q, const V& qd, const V& tau) {
    qdd(q, qd, tau);  // leaves the ground motion that springs need
    return external_power(plan, ws, q.data(), qd.data(), tau.data());
  }

  // Position residuals of all loop rows; `rate` as well.
  V residual(const V& q, const V& qd) {
    set_loops(q, qd);
    return Eigen::Map<const V>(ws.loop.residual.data(), static_cast<Eigen::Index>(ws.loop.residual.size()));
  }
  V rate(const V& q, const V& qd) {
    set_loops(q, qd);
    return Eigen::Map<const V>(ws.loop.rate.data(), static_cast<Eigen::Index>(ws.loop.rate.size()));
  }
  V lambda() const {
    return Eigen::Map<const V>(ws.loop.lambda.data(), static_cast<Eigen::Index>(ws.loop.lambda.size()));
  }
  int rank() const { return loop_rank(plan, ws); }

 private:
  void set_loops(const V& q, const V& qd) {
    set_positions(plan, ws, q.data());
    set_velocities(plan, ws, qd.data());
    set_ground_motion(plan, ws, qd.data());
    set_constraint_residuals(plan, ws, q.data(), qd.data());
  }
};

// Largest difference against the largest entry of both (1 when both are small).
inline double relative_difference(const Vector& a, const Vector& b) {
  if (a.size() == 0) return 0;
  const double scale = std::max({1.0, a.lpNorm<Eigen::Infinity>(), b.lpNorm<Eigen::Infinity>()});
  const double difference = (a - b).lpNorm<Eigen::Infinity>();
  return std::isfinite(difference) ? difference / scale : 1e300;
}

}  // namespace redysim::test
