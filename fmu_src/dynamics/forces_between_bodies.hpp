#pragma once

#include "dynamics/bushing.hpp"
#include "dynamics/contact/contact_force.hpp"
#include "dynamics/elastic_coupling.hpp"
#include "dynamics/ground_motion.hpp"

namespace redysim {

// Adds the wrenches of springs, bushings, elastic couplings and contacts, that is, subtracts them from the
// bias wrenches of the bodies. Uses positions.
template <class Scalar>
void add_forces_between_bodies(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q,
                               const Scalar* qd) {
  if (plan.has_poses()) set_ground_motion(plan, ws, qd);
  if (plan.has_springs()) add_spring_wrenches(plan, ws);
  if constexpr (Plan<Scalar>::may_have_bushings)
    if (plan.has_bushings()) add_bushing_wrenches(plan, ws);
  if (plan.has_elastic_couplings()) add_coupling_forces(plan, ws, q, qd);
  if constexpr (Plan<Scalar>::may_have_contacts)
    if (plan.has_contacts()) add_contact_wrenches(plan, ws);
}

}  // namespace redysim
