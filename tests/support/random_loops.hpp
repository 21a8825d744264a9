#pragma once

#include <cmath>
#include <vector>

#include "support/evaluate.hpp"
#include "support/random_tree.hpp"

// Loops that are closed at a given pose of a given tree, and the dense solve they are compared with.

namespace redysim::test {

// Ground poses of all links at q (moving joints in order), by the products of DH displacements alone.
inline std::vector<Pose> poses_at(const Model& model, const Vector& q) {
  std::vector<Pose> poses;
  Eigen::Index next = 0;
  for (const Link& link : model.links) {
    DhParameters dh = link.joint.dh;
    if (link.joint.type == JointType::revolute) dh.theta += q[next++];
    if (link.joint.type == JointType::prismatic) dh.d += q[next++];
    const Pose own = pose_of(dh);
    poses.push_back(link.parent == ground ? own : poses[link.parent] * own);
  }
  return poses;
}

inline int moving_joints(const Model& model) {
  return static_cast<int>(std::count_if(model.links.begin(), model.links.end(), [](const Link& link) {
    return link.joint.type != JointType::fixed;
  }));
}

// The cut joint between links a and b (or ground) that is closed at `poses`.
inline Loop closed_loop(Random& random, LoopType type, int a, int b, const std::vector<Pose>& poses) {
  const Pose at_a = a == ground ? Pose() : poses[a], at_b = b == ground ? Pose() : poses[b];
  Loop loop;
  loop.name = "loop";
  loop.type = type;
  loop.link_a = a;
  loop.link_b = b;
  loop.point_a = random.vector(0.5);
  const Mat3<double> into_b = at_b.rotation.transpose() * at_a.rotation;
  loop.point_b = at_b.rotation.transpose() * (at_a.rotation * loop.point_a + at_a.position - at_b.position);
  loop.axis_a = random.direction();
  loop.x_a = loop.axis_a.cross(random.direction()).normalized();
  loop.axis_b = into_b * (type == LoopType::universal ? loop.x_a : loop.axis_a);
  loop.x_b = into_b * loop.x_a;
  if (type == LoopType::cylindrical || type == LoopType::prismatic)
    loop.point_b += loop.axis_b * random.between(-0.3, 0.3);
  const int directions = 1 + random.index(3);
  if (type == LoopType::point)
    for (int k = 0; k < directions; ++k) {
      Vec3<double> direction = random.direction();
      for (const Vec3<double>& other : loop.directions) direction -= other * other.dot(direction);
      loop.directions.push_back(direction.normalized());
    }
  return loop;
}

// M qdd + bias = tau + J^T lambda, J qdd = -J' qd, with J from the derivatives of the residuals, M from
// composite bodies and the least-norm lambda from a complete orthogonal decomposition.
struct DenseSolution {
  Matrix M, J, S;
  Vector bias, quadratic, qdd, lambda;
  Eigen::Index rank = 0;
};

inline Eigen::CompleteOrthogonalDecomposition<Matrix> rank_revealing(const Matrix& S) {
  Eigen::CompleteOrthogonalDecomposition<Matrix> out;
  out.setThreshold(1e-10);
  out.compute(S);
  return out;
}

inline Matrix loop_jacobian(const Model& model, const Vector& q) {
  Evaluate<Dual> exact(model);
  const Vector zero = Vector::Zero(q.size());
  Matrix J(static_cast<Eigen::Index>(exact.ws.loop.residual.size()), q.size());
  for (Eigen::Index j = 0; j < q.size(); ++j)
    J.col(j) = derivative(exact.residual(dual(q, Vector::Unit(q.size(), j)), dual(zero, zero)));
  return J;
}

inline DenseSolution dense_solution(const Model& model, const Vector& q, const Vector& qd,
                                    const Vector& tau) {
  Evaluate<double> tree(model);
  Evaluate<Dual> exact(model);
  const Vector zero = Vector::Zero(q.size());
  DenseSolution out;
  out.M = tree.inertia(q);
  out.bias = tree.tau(q, qd, zero);
  out.J = loop_jacobian(model, q);
  // J' qd: how the rates J qd change along qd
  out.quadratic = derivative(exact.rate(dual(q, qd), dual(qd, zero)));
  const Eigen::LLT<Matrix> factor(out.M);
  const Vector free = factor.solve(tau - out.bias);
  const Matrix response = factor.solve(out.J.transpose());
  out.S = out.J * response;
  const auto decomposition = rank_revealing(out.S);
  out.rank = decomposition.rank();
  out.lambda = decomposition.solve(-out.quadratic - out.J * free);
  out.qdd = free + response * out.lambda;
  return out;
}

// qd without its part across the constraints (mass metric).
inline Vector closed_velocity(const Model& model, const Vector& q, const Vector& qd) {
  Evaluate<double> tree(model);
  const Matrix J = loop_jacobian(model, q);
  const Matrix response = tree.inertia(q).llt().solve(J.transpose());
  return qd - response * rank_revealing(J * response).solve(J * qd);
}

}  // namespace redysim::test
