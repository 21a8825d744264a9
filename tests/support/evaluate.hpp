#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "dynamics/workspace.hpp"
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

// Compiled once for double and Dual, in evaluate.cpp.
template <class Scalar>
struct Evaluate {
  using V = VectorOf<Scalar>;
  Plan<Scalar> plan;
  Workspace<Scalar> ws;

  explicit Evaluate(const Model& model);

  int nv() const { return plan.nv; }

  V qdd(const V& q, const V& qd, const V& tau);
  V tau(const V& q, const V& qd, const V& qdd);
  Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> inertia(const V& q);
  Scalar kinetic(const V& q, const V& qd);
  Scalar potential(const V& q, const V& qd);
  Scalar power(const V& q, const V& qd, const V& tau);

  // Position residuals of all loop rows; `rate` as well.
  V residual(const V& q, const V& qd);
  V rate(const V& q, const V& qd);
  V lambda() const;
  int rank() const;

 private:
  void set_loops(const V& q, const V& qd);
};

extern template struct Evaluate<double>;
extern template struct Evaluate<Dual>;

// Largest difference against the largest entry of both (1 when both are small).
inline double relative_difference(const Vector& a, const Vector& b) {
  if (a.size() == 0) return 0;
  const double scale = std::max({1.0, a.lpNorm<Eigen::Infinity>(), b.lpNorm<Eigen::Infinity>()});
  const double difference = (a - b).lpNorm<Eigen::Infinity>();
  return std::isfinite(difference) ? difference / scale : 1e300;
}

}  // namespace redysim::test
