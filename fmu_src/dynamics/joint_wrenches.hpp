#pragma once

#include "dynamics/loops/loop_rows.hpp"
#include "dynamics/rnea.hpp"

namespace redysim {

// Adds the wrenches of the multipliers to the bodies, that is, subtracts them from ws.joints[i].p. Uses
// ws.ground; fills the loop rows. Rows with directions fixed to the ground have no moment on the ground body,
// their root.
template <class Scalar>
void subtract_loop_wrenches(const Plan<Scalar>& plan, Workspace<Scalar>& ws,
                            const std::vector<Scalar>& lambda) {
  set_loop_rows(plan, ws);
  for (const auto& loop : plan.loops)
    for (std::size_t row = loop.first_row; row < loop.first_row + loop.rows.size(); ++row)
      for (const auto& [body, wrench] : {std::pair(loop.body_a, &ws.loop.wrench[0][row]),
                                         std::pair(loop.body_b, &ws.loop.wrench[1][row])}) {
        if (body == ground) continue;
        ws.joints[body].p.moment -= lambda[row] * wrench->moment;
        ws.joints[body].p.force -= lambda[row] * wrench->force;
      }
}

// Inverse dynamics with all forces between bodies. Sets ws.joints[i].p to the wrench that joint i transmits
// to its body, at the origin and in the axes of the body, and tau to the drive forces. Uses q, qd, qdd (nv),
// moments and forces of the ports, and the multipliers of all rows.
template <class Scalar>
void set_joint_wrenches(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd,
                        const Scalar* qdd, const Scalar* ports, const std::vector<Scalar>& lambda,
                        Scalar* tau) {
  set_body_wrenches(plan, ws, q, qd, qdd, plan.gravity);
  if (plan.has_poses()) set_ground_motion(plan, ws, qd);
  add_spring_wrenches(plan, ws);
  if constexpr (Plan<Scalar>::may_have_bushings) add_bushing_wrenches(plan, ws);
  if constexpr (Plan<Scalar>::may_have_contacts) add_contact_wrenches(plan, ws);
  add_port_wrenches(plan, ws, ports);
  if (plan.has_constraints()) subtract_loop_wrenches(plan, ws, lambda);
  collect_joint_forces(plan, ws, q, qd, qdd, tau);
}

}  // namespace redysim
