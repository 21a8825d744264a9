#pragma once

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"
#include "math/recorded.hpp"

namespace redysim {

// The plan of an open tree with base inertial parameters (Gautier and Khalil 1990): what moves alike with a
// body and its parent becomes part of the parent, or of the ground, so that more parameters are zero. The
// same forces of the joints; other wrenches between bodies. Uses q; overwrites positions.
Plan<Recorded> with_base_parameters(Plan<Recorded> plan, Workspace<Recorded>& ws, const Recorded* q);

// qdd (nv) from q, qd and the forces tau of the joints (nv): M qdd = tau - bias, with the bias of the
// recursive Newton-Euler equations, M of composite bodies and L^T D L of M with the sparsity of the tree
// (Featherstone 2008, Tables 6.2 and 6.3). As a straight line it has fewer operations than the recursion of
// aba.hpp up to about 11 joints in series. Open trees without prescribed joints.
void composite_forward_dynamics(const Plan<Recorded>& plan, Workspace<Recorded>& ws, const Recorded* q,
                                const Recorded* qd, const Recorded* tau, Recorded* qdd);

}  // namespace redysim
