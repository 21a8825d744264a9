#pragma once

#include "dynamics/bias.hpp"
#include "dynamics/bushing.hpp"
#include "dynamics/contact/contact_force.hpp"
#include "dynamics/elastic_coupling.hpp"

namespace redysim {

// Kinetic energy, J, at (q, qd), including the armatures. Overwrites positions and twists of the
// workspace.
template <class Scalar>
Scalar kinetic_energy(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q, const Scalar* qd) {
  set_twists(plan, ws, q, qd);
  Scalar twice(0);
  for (std::size_t i = 0; i < plan.joints.size(); ++i) {
    const JointPlan<Scalar>& joint = plan.joints[i];
    const Motion<Scalar>& twist = ws.joints[i].twist();
    twice += dot(joint.inertia * twist, twist) + joint.armature * qd[i] * qd[i];
  }
  return Scalar(0.5) * twice;
}

// Potential energy, J, of gravity (zero with all mass at the ground origin), joint springs,
// stops, spring-dampers, bushings, elastic couplings and contacts at q. Overwrites positions and composite
// masses of the workspace.
template <class Scalar>
[[gnu::cold]] Scalar potential_energy(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q,
                                      const Scalar* qd) {
  set_positions(plan, ws, q);
  Scalar energy = -plan.grounded.dot(plan.gravity);
  // gravity: mass and first moment, leaves to root
  for (auto& body : ws.composite) body = {Scalar(0), Vec3<Scalar>::Zero()};
  for (std::size_t i = plan.joints.size(); i-- > 0;) {
    const JointPlan<Scalar>& joint = plan.joints[i];
    CompositeMass<Scalar>& body = ws.composite[i];
    body.h += joint.inertia.h;
    body.mass += joint.inertia.mass;
    Mat3<Scalar> rotation;
    Vec3<Scalar> position;
    joint_pose(joint, ws.joints[i], rotation, position);
    const Vec3<Scalar> at_parent = rotation * body.h + body.mass * position;
    if (joint.parent == ground) {
      energy -= at_parent.dot(plan.gravity);
    } else {
      ws.composite[joint.parent].h += at_parent;
      ws.composite[joint.parent].mass += body.mass;
    }
    energy += joint_energy(plan, static_cast<int>(i), q[i]);
  }
  for (std::size_t k = 0; plan.has_elastic_couplings() && k < plan.elastic_couplings.size(); ++k)
    energy += coupling_force(plan.elastic_couplings[k], q, qd).energy;
  if (!plan.has_springs() && !plan.has_bushings() && !plan.has_contacts()) return energy;
  set_ground_motion(plan, ws, qd);
  for (const auto& spring : plan.springs) {
    const Scalar stretch = spring_line(spring, ws).length - spring.rest_length;
    energy += Scalar(0.5) * spring.stiffness * stretch * stretch;
  }
  if constexpr (Plan<Scalar>::may_have_bushings)
    if (plan.has_bushings()) energy += bushing_energy(plan, ws);
  if constexpr (Plan<Scalar>::may_have_contacts)
    if (plan.has_contacts()) energy += contact_energy(plan, ws);
  return energy;
}

// Power of drives, dampers, bushings, friction and contacts, W: the rate of kinetic plus potential energy.
// Uses the ground motion and the contact power in the workspace of the last forward_dynamics.
template <class Scalar>
Scalar external_power(const Plan<Scalar>& plan, const Workspace<Scalar>& ws, const Scalar* q,
                      const Scalar* qd, const Scalar* tau) {
  Scalar power(0);
  for (int i = 0; i < plan.nv; ++i) {
    power += qd[i] * tau[i];
    if (plan.joints[i].has_passive_force) power += joint_loss(plan, i, q[i], qd[i]);
  }
  for (std::size_t i = 0; plan.has_springs() && i < plan.springs.size(); ++i) {
    const SpringPlan<Scalar>& spring = plan.springs[i];
    const Scalar rate = spring_line(spring, ws).rate;
    power -= spring.damping * rate * rate;
  }
  for (std::size_t k = 0; plan.has_elastic_couplings() && k < plan.elastic_couplings.size(); ++k)
    power += coupling_force(plan.elastic_couplings[k], q, qd).loss;
  if constexpr (Plan<Scalar>::may_have_bushings)
    if (plan.has_bushings()) power += bushing_loss(plan, ws);
  if constexpr (Plan<Scalar>::may_have_contacts)
    if (plan.has_contacts()) power += ws.contact_power;
  return power;
}

// Power of a port's wrench (moment and force, 6 numbers), W. Uses the joint positions in the workspace.
template <class Scalar>
[[gnu::cold]] Scalar port_power(const Plan<Scalar>& plan, const Workspace<Scalar>& ws,
                                const PortPlan<Scalar>& port, const Scalar* qd, const Scalar* wrench) {
  const GroundState<Scalar> body =
      port.in_ground_axes ? ws.ground[port.entry] : body_motion(plan, ws, port.body, qd);
  Vec3<Scalar> moment(wrench[0], wrench[1], wrench[2]), force(wrench[3], wrench[4], wrench[5]);
  if (!port.in_ground_axes) {
    moment = body.rotation * (port.rotation * moment);
    force = body.rotation * (port.rotation * force);
  }
  return moment.dot(body.omega) + force.dot(point_motion(body, port.position).velocity);
}

}  // namespace redysim
