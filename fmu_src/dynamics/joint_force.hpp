#pragma once

#include <cmath>

#include "dynamics/plan.hpp"
#include "dynamics/smooth_onset.hpp"

// Forces in a joint: drive, spring, damper, dry friction and stops; their energy and dissipation. Constants
// and states may have different scalar types, so that dual states give derivatives.
//
// Friction after Brown and McPhee (2016), smooth in the velocity; s = qd / friction_velocity:
//   friction tanh(4 s) + (static_friction - friction) s / (s^2 / 4 + 3 / 4)^2       maximum at s = 1
// Force of a stop: dynamics/smooth_onset.hpp.

namespace redysim {

template <class Constant, class Scalar>
Scalar dry_friction(const Resistance<Constant>& joint, const Scalar& qd) {
  using std::tanh;
  const Scalar s = joint.per_velocity * qd, spread = Scalar(0.25) * s * s + Scalar(0.75);
  return joint.friction * tanh(Scalar(4) * s) + joint.excess * s / (spread * spread);
}

// The stop in contact: depth (0 between the stops) and side.
template <class Constant, class Scalar>
struct PressedStop {
  const Resistance<Constant>& joint;
  Scalar depth, side;  // side: 1 upper, -1 lower

  PressedStop(const Resistance<Constant>& of, const Scalar& q) : joint(of), depth(0), side(-1) {
    const Scalar over = q - of.upper, under = of.lower - q;
    if (under > Scalar(0)) depth = under;
    if (over > Scalar(0)) {
      depth = over;
      side = Scalar(1);
    }
  }
  Scalar elastic_force() const { return joint.stiffness * onset().force(); }
  Scalar energy() const { return joint.stiffness * onset().energy(); }
  Scalar growth(const Scalar& qd) const { return impact_growth(Scalar(joint.damping * side * qd)); }

 private:
  SmoothOnset<Scalar> onset() const { return {depth, Scalar(joint.width)}; }
};

// Force of dry friction and stops in joint i.
template <class Constant, class Scalar>
Scalar resistance_force(const Plan<Constant>& plan, int i, const Scalar& q, const Scalar& qd) {
  const JointPlan<Constant>& joint = plan.joints[i];
  Scalar force(0);
  if (joint.has_friction) force -= dry_friction(plan.resistances[i], qd);
  if (joint.has_stops) {
    const PressedStop<Constant, Scalar> stop(plan.resistances[i], q);
    force -= stop.side * stop.elastic_force() * stop.growth(qd);
  }
  return force;
}

// Torque or force in joint i, including the drive.
template <class Constant, class Scalar>
Scalar joint_force(const Plan<Constant>& plan, int i, const Scalar& q, const Scalar& qd, const Scalar& tau) {
  const JointPlan<Constant>& joint = plan.joints[i];
  if (!joint.has_passive_force) return tau;
  const Scalar force = tau - joint.stiffness * (q - joint.rest) - joint.damping * qd;
  if (!features::friction || !joint.has_resistance) return force;
  return force + resistance_force(plan, i, q, qd);
}

// Passive force, without the drive: conservative part and dissipative part.
template <class Scalar>
struct PassiveForce {
  Scalar stored, lost;
};
template <class Constant, class Scalar>
PassiveForce<Scalar> passive_force(const Plan<Constant>& plan, int i, const Scalar& q, const Scalar& qd) {
  const JointPlan<Constant>& joint = plan.joints[i];
  PassiveForce<Scalar> force{-(joint.stiffness * (q - joint.rest)), -(joint.damping * qd)};
  if (features::friction && joint.has_friction) force.lost -= dry_friction(plan.resistances[i], qd);
  if (features::friction && joint.has_stops) {
    const PressedStop<Constant, Scalar> stop(plan.resistances[i], q);
    const Scalar elastic = stop.side * stop.elastic_force();
    force.stored -= elastic;
    force.lost -= elastic * (stop.growth(qd) - Scalar(1));
  }
  return force;
}

// Energy stored in the spring and the stops of joint i, J.
template <class Constant, class Scalar>
Scalar joint_energy(const Plan<Constant>& plan, int i, const Scalar& q) {
  const JointPlan<Constant>& joint = plan.joints[i];
  const Scalar stretch = q - joint.rest;
  const Scalar energy = Scalar(0.5) * joint.stiffness * stretch * stretch;
  if (!features::friction || !joint.has_stops) return energy;
  return energy + PressedStop<Constant, Scalar>(plan.resistances[i], q).energy();
}

// Power of the damper, the friction and the stops' damping of joint i, W; never positive.
template <class Constant, class Scalar>
Scalar joint_loss(const Plan<Constant>& plan, int i, const Scalar& q, const Scalar& qd) {
  return passive_force(plan, i, q, qd).lost * qd;
}

}  // namespace redysim
