#include "dynamics/contact/contact_force.hpp"

#include <cmath>
#include <type_traits>

#include "dynamics/contact/separation.hpp"
#include "dynamics/contact/touch.hpp"
#include "dynamics/smooth_onset.hpp"
#include "math/angles.hpp"

namespace redysim {
namespace {

// Force and couple on the spheres' body at the contact point, in surface axes.
template <class Scalar>
struct ContactForce {
  Vec3<Scalar> force, couple;
};

// Friction coefficient divided by the slip velocity, s/m, after Brown and McPhee (2016).
template <class Scalar>
Scalar friction_per_velocity(const ContactLaw<Scalar>& law, const Vec3<Scalar>& slip) {
  using std::tanh;
  const Scalar s = law.per_velocity * safe_norm(slip), spread = Scalar(0.25) * s * s + Scalar(0.75);
  return law.per_velocity * (law.friction * tanh(Scalar(4) * s) / s + law.excess / (spread * spread));
}

template <class Scalar>
ContactForce<Scalar> smooth_contact(const ContactLaw<Scalar>& law, const Touch<Scalar>& touch) {
  using std::tanh;
  const Scalar normal = law.stiffness * SmoothOnset<Scalar>(touch.depth, law.width).force() *
                        impact_growth(Scalar(law.damping * touch.approach));
  ContactForce<Scalar> out;
  out.force = normal * Vec3<Scalar>(touch.normal - friction_per_velocity(law, touch.slip) * touch.slip);
  out.couple.setZero();
  if (law.rolling > Scalar(0) || law.torsion > Scalar(0)) {
    const Scalar pivoting = touch.normal.dot(touch.spin);
    const Vec3<Scalar> rolling = touch.spin - pivoting * touch.normal;
    const Scalar s = safe_norm(rolling);
    out.couple =
        -normal * Vec3<Scalar>((law.rolling * tanh(Scalar(4) * law.per_spin * s) / s) * rolling +
                               (law.torsion * tanh(Scalar(4) * law.per_spin * pivoting)) * touch.normal);
  }
  return out;
}

// ReDySim's law: K p - C v from a penetration of 1e-5 m on, with a cubic C(p) while separating; independent
// friction along the surface's x and y axes.
template <class Scalar>
ContactForce<Scalar> redysim_contact(const ContactLaw<Scalar>& law, const Touch<Scalar>& touch) {
  using std::abs;
  using std::atan;
  ContactForce<Scalar> out;
  out.force.setZero();
  out.couple.setZero();
  if (touch.depth < Scalar(redysim_least_depth)) return out;
  Scalar damping = law.damping;
  const Scalar full = Scalar(1.2) * law.v_max * law.damping / law.stiffness;
  if (touch.approach < Scalar(0) && touch.depth < full) {
    const Scalar u = touch.depth / full;
    damping *= u * u * (Scalar(3) - Scalar(2) * u);
  }
  const Scalar normal = law.stiffness * touch.depth + damping * touch.approach;
  const Scalar largest = Scalar(2 / pi) * law.friction * abs(normal);
  if (largest > Scalar(0))
    for (int axis = 0; axis < 2; ++axis)
      out.force[axis] = -largest * atan(Scalar(law.Ch * touch.slip[axis] / largest));
  out.force += normal * touch.normal;
  return out;
}

template <class Scalar>
[[gnu::noinline]] ContactForce<Scalar> contact_force(const ContactLaw<Scalar>& law,
                                                     const Touch<Scalar>& touch) {
  return law.redysim ? redysim_contact(law, touch) : smooth_contact(law, touch);
}

// Energy stored at a contact point, J; 0 for ReDySim's law, whose power counts as work completely.
template <class Scalar>
Scalar stored_energy(const ContactLaw<Scalar>& law, const Touch<Scalar>& touch) {
  if (law.redysim) return Scalar(0);
  return law.stiffness * SmoothOnset<Scalar>(touch.depth, law.width).energy();
}

// Region of a pressed point between the corners of its normal force.
unsigned region(const ContactLaw<double>& law, const Touch<double>& touch) {
  if (law.redysim) return touch.depth < redysim_least_depth ? 0 : 1;
  return 3 * static_cast<unsigned>(touch.surface_region) + onset_region(touch.depth, law.width);
}

// Power of a contact point without that of stored energy, W.
template <class Scalar>
Scalar contact_loss(const ContactLaw<Scalar>& law, const Touch<Scalar>& touch,
                    const ContactForce<Scalar>& out) {
  const Vec3<Scalar> velocity = touch.slip - touch.normal * touch.approach;
  const Scalar power = out.force.dot(velocity) + out.couple.dot(touch.spin);
  if (law.redysim) return power;
  return power + law.stiffness * SmoothOnset<Scalar>(touch.depth, law.width).force() * touch.depth_rate;
}

// A force and a couple at a point of the ground frame, in ground axes.
template <class Scalar>
struct PointWrench {
  Vec3<Scalar> point, force, couple;
};

template <class Scalar>
PointWrench<Scalar> in_ground_frame(const ContactForce<Scalar>& of, const Touch<Scalar>& touch,
                                    const RelativeMotion<Scalar>& motion) {
  return {motion.origin + motion.axes * touch.position, motion.axes * of.force, motion.axes * of.couple};
}

// Adds `sign` times a wrench to the external wrenches of a body, with the pose `entry`.
template <class Scalar>
void act_on(Workspace<Scalar>& ws, int body, int entry, const PointWrench<Scalar>& at, double sign) {
  if (body == ground) return;
  const GroundState<Scalar>& state = ws.ground[entry];
  const auto into_body = state.rotation.transpose();
  const Vec3<Scalar> arm = at.point - state.position, moment = at.couple + arm.cross(at.force);
  ws.joints[body].p.moment -= Scalar(sign) * Vec3<Scalar>(into_body * moment);
  ws.joints[body].p.force -= Scalar(sign) * Vec3<Scalar>(into_body * at.force);
}

// Calls visit(law, touch, motion) for each contact point of a pair with positive depth.
template <class Scalar, class Visit>
void visit_pressed(const Plan<Scalar>& plan, const Workspace<Scalar>& ws, const ContactPair<Scalar>& pair,
                   Visit visit) {
  if (separation(pair, ws) > Scalar(0)) return;
  visit_touches(pair, ws, [&](const Touch<Scalar>& touch, const RelativeMotion<Scalar>& motion) {
    if (touch.depth > Scalar(0)) visit(plan.contact_laws[pair.contact], touch, motion);
  });
}

}  // namespace

template <class Scalar>
void add_contact_wrenches(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const ContactPair<Scalar>& pair) {
  visit_pressed(
      plan, ws, pair,
      [&](const ContactLaw<Scalar>& law, const Touch<Scalar>& touch, const RelativeMotion<Scalar>& motion) {
        const ContactForce<Scalar> force = contact_force(law, touch);
        const auto wrench = in_ground_frame(force, touch, motion);
        act_on(ws, pair.sphere_body, pair.sphere_entry, wrench, 1);
        act_on(ws, pair.surface_body, pair.surface_entry, wrench, -1);
        ws.contact_power += contact_loss(law, touch, force);
        if constexpr (std::is_same_v<Scalar, double>) {
          const auto index = static_cast<std::uint64_t>(&pair - plan.contact_pairs.data());
          const std::uint64_t number = (index << 16) + touch.sphere + 1;
          ws.contact_regions += number * number * number * region(law, touch);
        }
      });
}

template <class Scalar>
void add_contact_wrenches(const Plan<Scalar>& plan, Workspace<Scalar>& ws) {
  ws.contact_power = Scalar(0);
  ws.contact_regions = 0;
  for (const ContactPair<Scalar>& pair : plan.contact_pairs) add_contact_wrenches(plan, ws, pair);
}

template <class Scalar>
Scalar contact_energy(const Plan<Scalar>& plan, const Workspace<Scalar>& ws) {
  Scalar energy(0);
  for (const ContactPair<Scalar>& pair : plan.contact_pairs)
    visit_pressed(plan, ws, pair,
                  [&](const ContactLaw<Scalar>& law, const Touch<Scalar>& touch,
                      const RelativeMotion<Scalar>&) { energy += stored_energy(law, touch); });
  return energy;
}

template <class Scalar>
[[gnu::cold]] ContactResult<Scalar> contact_result(const Plan<Scalar>& plan, const Workspace<Scalar>& ws,
                                                   int contact, int link_a) {
  ContactResult<Scalar> result;
  for (const ContactPair<Scalar>& pair : plan.contact_pairs) {
    if (pair.contact != contact) continue;
    const GroundState<Scalar>& body =
        ground_state(ws, pair.spheres_on_b ? pair.surface_entry : pair.sphere_entry);
    Vec3<Scalar> about = body.position;
    if (link_a != ground)
      about += body.rotation * plan.frame_in_carrier[link_a].position.template cast<Scalar>();
    const ContactLaw<Scalar>& law = plan.contact_laws[contact];
    const Scalar sign(pair.spheres_on_b ? -1 : 1);
    visit_touches(pair, ws, [&](const Touch<Scalar>& touch, const RelativeMotion<Scalar>& motion) {
      ContactForce<Scalar> force{Vec3<Scalar>::Zero(), Vec3<Scalar>::Zero()};
      if (touch.depth > Scalar(0)) force = contact_force(law, touch);
      const PointWrench<Scalar> at = in_ground_frame(force, touch, motion);
      result.force += sign * at.force;
      result.moment += sign * Vec3<Scalar>(at.couple + Vec3<Scalar>(at.point - about).cross(at.force));
      if (!(touch.depth > result.depth)) return;
      result.depth = touch.depth;
      result.point = at.point + plan.origin;
      result.slip = safe_norm(touch.slip);
    });
  }
  return result;
}

void contact_distances(const ContactPair<double>& pair, const Workspace<double>& ws,
                       ContactDistance* distances) {
  const double finite = pair.surface.is_finite() ? 1 : 0;
  visit_touches(pair, ws, [&](const Touch<double>& touch, const RelativeMotion<double>&) {
    *distances++ = {-touch.depth, -touch.depth_rate, finite * touch.center_velocity};
  });
}

template void add_contact_wrenches(const Plan<double>&, Workspace<double>&);
template double contact_energy(const Plan<double>&, const Workspace<double>&);
template ContactResult<double> contact_result(const Plan<double>&, const Workspace<double>&, int, int);
template void add_contact_wrenches(const Plan<Dual>&, Workspace<Dual>&);
template void add_contact_wrenches(const Plan<Dual>&, Workspace<Dual>&, const ContactPair<Dual>&);
template Dual contact_energy(const Plan<Dual>&, const Workspace<Dual>&);
template ContactResult<Dual> contact_result(const Plan<Dual>&, const Workspace<Dual>&, int, int);

}  // namespace redysim
