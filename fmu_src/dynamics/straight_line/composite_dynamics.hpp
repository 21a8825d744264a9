#pragma once

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"
#include "math/recorded.hpp"

namespace redysim {

// The plan of an open tree with base inertial parameters (Gautier and Khalil 1990): the inertia that has the
// same effect on a body and its parent is moved to the parent, or to the ground, so that more parameters are
// zero. Joint forces are the same, other wrenches between bodies differ. Uses q; overwrites positions.
Plan<Recorded> with_base_parameters(Plan<Recorded> plan, Workspace<Recorded>& ws, const Recorded* q);

using RecordedMatrix = Eigen::Matrix<Recorded, Eigen::Dynamic, Eigen::Dynamic>;

// M = L^T D L with the sparsity of the tree (Featherstone 2008, Table 6.3), for the joints that are not
// prescribed.
class TreeFactor {
 public:
  TreeFactor(const Plan<Recorded>& plan, RecordedMatrix M);
  void eliminate(Recorded* forces) const;   // forces (nv) <- L^-T forces, zero for prescribed joints
  void substitute(Recorded* forces) const;  // after `eliminate`: forces <- L^-1 D^-1 forces, accelerations
  const Recorded& inverse_pivot(int k) const { return L_(k, k); }  // zero for a prescribed joint

 private:
  // Nearest inboard joint that is not prescribed.
  int parent(int i) const;

  const Plan<Recorded>& plan_;
  RecordedMatrix L_;  // with D^-1 on the diagonal
};

// Acceleration of a body and of its origin (minus gravity), and U = alpha~ + omega~ omega~: point r of the
// body has the acceleration of the origin + U r. In body axes.
struct BodyAcceleration {
  Vec3<Recorded> angular = Vec3<Recorded>::Zero(), linear = Vec3<Recorded>::Zero();
  Mat3<Recorded> U = Mat3<Recorded>::Zero();
};

// Equations of motion M qdd = tau - bias of an open tree at (q, qd): the bias from the recursive Newton-Euler
// equations, including force elements, wrenches at ports and the accelerations of prescribed joints, M from
// composite bodies (Featherstone 2008, Table 6.2). As straight-line code they take fewer operations than the
// recursion of aba.hpp up to about 11 joints in series. `inputs`: of the recursion (InputLayout).
struct TreeEquations {
  TreeEquations(const Plan<Recorded>& plan, Workspace<Recorded>& ws, const Recorded* q, const Recorded* qd,
                const Recorded* inputs);

  // Accelerations of the bodies at qdd = 0 of the joints that are not prescribed.
  std::vector<BodyAcceleration> at_rest;
  std::vector<Recorded> bias;  // nv
  RecordedMatrix M;
  TreeFactor factor;
};

}  // namespace redysim
