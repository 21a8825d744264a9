#pragma once

#include <limits>

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"

// Forces of contacts, their energy and power: docs/contact.md. All functions use the ground motion in the
// workspace. Instantiated for double and Dual.

namespace redysim {

// Adds the wrenches of all contact points to the bodies, that is, subtracts them from the bias wrenches, and
// sets ws.contact_power.
template <class Scalar>
void add_contact_wrenches(const Plan<Scalar>& plan, Workspace<Scalar>& ws);

// The same for one pair; its power is added to ws.contact_power.
template <class Scalar>
void add_contact_wrenches(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const ContactPair<Scalar>& pair);

// Energy stored in all contacts, J.
template <class Scalar>
Scalar contact_energy(const Plan<Scalar>& plan, const Workspace<Scalar>& ws);

// Distance of a contact point from the surface, m, and its rate, m/s. `velocity`: of its center, in the frame
// of a finite surface; zero for other surfaces.
struct ContactDistance {
  double value, rate;
  Vec3<double> velocity;
};

// Sets one distance per contact point of a pair.
void contact_distances(const ContactPair<double>& pair, const Workspace<double>& ws,
                       ContactDistance* distances);

// Sum over the points of one contact: force and moment on link a about the origin of its frame, in ground
// axes. Depth (negative: distance), position and slip velocity of the deepest point.
template <class Scalar>
struct ContactResult {
  Vec3<Scalar> force = Vec3<Scalar>::Zero(), moment = Vec3<Scalar>::Zero();
  Scalar depth = Scalar(-std::numeric_limits<double>::max()), slip = 0;
  Vec3<Scalar> point = Vec3<Scalar>::Zero();
};

template <class Scalar>
ContactResult<Scalar> contact_result(const Plan<Scalar>& plan, const Workspace<Scalar>& ws, int contact,
                                     int link_a);

}  // namespace redysim
