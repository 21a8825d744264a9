#include "support/evaluate.hpp"

#include "dynamics/aba.hpp"
#include "dynamics/crba.hpp"
#include "dynamics/energy.hpp"
#include "dynamics/rnea.hpp"

namespace redysim::test {

template <class Scalar>
Evaluate<Scalar>::Evaluate(const Model& model) : plan(model), ws(plan) {}

template <class Scalar>
VectorOf<Scalar> Evaluate<Scalar>::qdd(const V& q, const V& qd, const V& tau) {
  V out(plan.nv);
  forward_dynamics(plan, ws, q.data(), qd.data(), tau.data(), out.data());
  return out;
}

template <class Scalar>
VectorOf<Scalar> Evaluate<Scalar>::tau(const V& q, const V& qd, const V& qdd) {
  V out(plan.nv);
  inverse_dynamics(plan, ws, q.data(), qd.data(), qdd.data(), out.data());
  return out;
}

template <class Scalar>
Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> Evaluate<Scalar>::inertia(const V& q) {
  Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> M(plan.nv, plan.nv);
  joint_space_inertia<Scalar>(plan, ws, q.data(), M);
  return M;
}

template <class Scalar>
Scalar Evaluate<Scalar>::kinetic(const V& q, const V& qd) {
  return kinetic_energy(plan, ws, q.data(), qd.data());
}

template <class Scalar>
Scalar Evaluate<Scalar>::potential(const V& q, const V& qd) {
  return potential_energy(plan, ws, q.data(), qd.data());
}

template <class Scalar>
Scalar Evaluate<Scalar>::power(const V& q, const V& qd, const V& tau) {
  qdd(q, qd, tau);  // leaves the ground motion that springs need
  return external_power(plan, ws, q.data(), qd.data(), tau.data());
}

template <class Scalar>
VectorOf<Scalar> Evaluate<Scalar>::residual(const V& q, const V& qd) {
  set_loops(q, qd);
  return Eigen::Map<const V>(ws.loop.residual.data(), static_cast<Eigen::Index>(ws.loop.residual.size()));
}

template <class Scalar>
VectorOf<Scalar> Evaluate<Scalar>::rate(const V& q, const V& qd) {
  set_loops(q, qd);
  return Eigen::Map<const V>(ws.loop.rate.data(), static_cast<Eigen::Index>(ws.loop.rate.size()));
}

template <class Scalar>
VectorOf<Scalar> Evaluate<Scalar>::lambda() const {
  return Eigen::Map<const V>(ws.loop.lambda.data(), static_cast<Eigen::Index>(ws.loop.lambda.size()));
}

template <class Scalar>
int Evaluate<Scalar>::rank() const {
  int rank = 0;
  for (std::size_t c = 0; c < plan.clusters.size(); ++c)
    rank += is_by_fronts(plan, ws.loop, c) ? plan.clusters[c].row_count : ws.loop.S[c].rank();
  return rank;
}

template <class Scalar>
void Evaluate<Scalar>::set_loops(const V& q, const V& qd) {
  set_positions(plan, ws, q.data());
  set_velocities(plan, ws, qd.data());
  set_ground_motion(plan, ws, qd.data());
  set_constraint_residuals(plan, ws, q.data(), qd.data());
}

template struct Evaluate<double>;
template struct Evaluate<Dual>;

}  // namespace redysim::test
