#pragma once

#include "dynamics/bias.hpp"

namespace redysim {

// Linear momentum (kg m/s) and angular momentum about the ground's origin (kg m^2/s) of all bodies, in ground
// axes, as force and moment of the result. Uses q, qd (plan.nv); overwrites positions, p and twists.
template <class Scalar>
Force<Scalar> momentum(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd) {
  set_twists(plan, ws, q, qd);
  for (std::size_t i = 0; i < plan.joints.size(); ++i)
    ws.joints[i].p = plan.joints[i].inertia * ws.joints[i].twist();
  Force<Scalar> total = Force<Scalar>::zero();
  for (std::size_t i = plan.joints.size(); i-- > 0;) {
    Force<Scalar> h = ws.joints[i].p;
    to_parent(plan.joints[i], ws.joints[i], h);
    const int parent = plan.joints[i].parent;
    add(parent == ground ? total : ws.joints[parent].p, h);
  }
  return total;
}

}  // namespace redysim
