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

// M = L^T D L with the sparsity of the tree (Featherstone 2008, Table 6.3).
class TreeFactor {
 public:
  TreeFactor(const Plan<Recorded>& plan, RecordedMatrix M);
  void eliminate(Recorded* forces) const;   // forces (nv) <- L^-T forces
  void substitute(Recorded* forces) const;  // after `eliminate`: forces <- L^-1 D^-1 forces, accelerations
  const Recorded& inverse_pivot(int k) const { return L_(k, k); }

 private:
  int parent(int i) const { return plan_.joints[i].parent; }

  const Plan<Recorded>& plan_;
  RecordedMatrix L_;  // with D^-1 on the diagonal
};

// Acceleration of a body and of its origin (minus gravity), and U = alpha~ + omega~ omega~: point r of the
// body has the acceleration of the origin + U r. In body axes.
struct BodyAcceleration {
  Vec3<Recorded> angular = Vec3<Recorded>::Zero(), linear = Vec3<Recorded>::Zero();
  Mat3<Recorded> U = Mat3<Recorded>::Zero();
};

// Equations of motion M qdd = tau - bias of an open tree without prescribed joints at (q, qd): the bias from
// the recursive Newton-Euler equations, including force elements and wrenches at ports, M from composite
// bodies (Featherstone 2008, Table 6.2). As straight-line code they take fewer operations than the recursion
// of aba.hpp up to about 11 joints in series.
struct TreeEquations {
  TreeEquations(const Plan<Recorded>& plan, Workspace<Recorded>& ws, const Recorded* q, const Recorded* qd,
                const Recorded* port_wrenches);

  std::vector<BodyAcceleration> at_rest;  // accelerations of the bodies at qdd = 0
  std::vector<Recorded> bias;             // nv
  TreeFactor factor;
};

}  // namespace redysim
