#pragma once

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"
#include "math/recorded.hpp"

namespace redysim {

// The plan of an open tree with base inertial parameters (Gautier and Khalil 1990): the inertia that has the
// same effect on a body and its parent is moved to the parent, or to the ground, so that more parameters are
// zero. Joint forces are the same, other wrenches between bodies differ. Uses q; overwrites positions.
Plan<Recorded> with_base_parameters(Plan<Recorded> plan, Workspace<Recorded>& ws, const Recorded* q);

// qdd (nv) from q, qd and the joint forces tau (nv): M qdd = tau - bias, with the bias from the recursive
// Newton-Euler equations, M from composite bodies, and L^T D L of M with the sparsity of the tree
// (Featherstone 2008, Tables 6.2 and 6.3). As straight-line code it has fewer operations than the recursion
// of aba.hpp up to about 11 joints in series. Open trees without prescribed joints only.
void composite_forward_dynamics(const Plan<Recorded>& plan, Workspace<Recorded>& ws, const Recorded* q,
                                const Recorded* qd, const Recorded* tau, Recorded* qdd);

}  // namespace redysim
