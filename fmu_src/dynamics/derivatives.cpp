#include "dynamics/derivatives.hpp"

#include <algorithm>

#include "dynamics/changes.hpp"
#include "dynamics/clones.hpp"
#include "dynamics/energy.hpp"
#include "dynamics/input_layout.hpp"
#include "dynamics/joint_wrenches.hpp"
#include "dynamics/loops/loop_correction.hpp"

// Equation numbers: docs/derivations/derivatives.md.

namespace redysim {

namespace {

// Updates the only parameters of elements that may change.
void update_contact_laws(const Plan<double>& from, Plan<Dual>& to) {
  if constexpr (Plan<Dual>::may_have_contacts)
    for (std::size_t i = 0; i < from.contact_laws.size(); ++i)
      to.contact_laws[i] = with_constants_of<Dual>(from.contact_laws[i]);
}

// Derivative of the bias wrench of a body along a change of its angular velocity.
Force<double> bias_change(const RigidInertia<double>& body, const Vec3<double>& omega,
                          const Vec3<double>& change) {
  return {change.cross(body.inertia * omega) + omega.cross(body.inertia * change),
          change * omega.dot(body.h) + omega * change.dot(body.h) - 2 * omega.dot(change) * body.h};
}

// Derivatives of passive force and power in a joint with respect to its position or velocity.
struct PassiveChange {
  double force = 0, loss = 0;
};
PassiveChange passive_change(const Plan<double>& plan, int joint, double q, double qd, bool velocity) {
  if (!plan.joints[joint].has_passive_force) return {};
  const Dual position(q, velocity ? 0 : 1), rate(qd, velocity ? 1 : 0);
  const PassiveForce<Dual> force = passive_force(plan, joint, position, rate);
  return {force.stored.derivative + force.lost.derivative, (force.lost * rate).derivative};
}

// Adds the derivatives of the forces of elastic couplings to `forces` (all joints); returns that of their
// dissipation.
[[gnu::cold]] double change_coupling_forces(const Plan<double>& plan, int joint, const double* q,
                                            const double* qd, bool velocity, std::vector<double>& forces) {
  double loss = 0;
  for (const ElasticCouplingPlan& coupling : plan.elastic_couplings) {
    const auto at = std::find(coupling.joints.begin(), coupling.joints.end(), joint);
    if (at == coupling.joints.end()) continue;
    const double ratio = coupling.ratios[static_cast<std::size_t>(at - coupling.joints.begin())];
    const Dual y(coupling_sum(coupling, q, coupling.offset), velocity ? 0 : ratio),
        rate(coupling_sum(coupling, qd, 0.0), velocity ? ratio : 0);
    const ElasticForce<Dual> change(coupling, y, rate);
    for (std::size_t k = 0; k < coupling.joints.size(); ++k)
      forces[static_cast<std::size_t>(coupling.joints[k])] -= coupling.ratios[k] * change.sum().derivative;
    loss += change.loss.derivative;
  }
  return loss;
}

void respond_fastest(const Plan<double>& plan, Workspace<double>& ws, const double* forces, double* qdd) {
  fastest([&] { respond(plan, ws, forces, qdd); });
}

}  // namespace

[[gnu::cold]] Derivatives::Elements::Elements(const Plan<double>& of) : plan(of), workspace(plan) {}

[[gnu::cold]] Derivatives::Derivatives(const Plan<double>& plan)
    : bodies_(plan.joints.size()),
      changes_(plan.joints.size()),
      forces_(plan.joints.size()),
      elements_(plan.has_poses() ? std::make_unique<Elements>(plan) : nullptr),
      displaced_(elements_ ? elements_->workspace.ground.size() : 0),
      port_wrenches_(static_cast<std::size_t>(InputLayout(plan).port_wrench.size())) {
  for (const ClusterPlan& cluster : plan.clusters) lambda_.resize(lambda_.size() + cluster.row_count);
  K_.resize(lambda_.size());
}

// Inverse dynamics at the evaluation point: accelerations of the bodies and wrenches through the joints.
void Derivatives::set_point(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                            const double* qd, const double* qdd, const double* ports) {
  std::copy(ws.loop.lambda.begin(), ws.loop.lambda.end(), lambda_.begin());
  // K is part of the elimination, but set_joint_wrenches overwrites it
  std::copy(ws.loop.K.begin(), ws.loop.K.end(), K_.begin());
  set_joint_wrenches(plan, ws, q, qd, qdd, ports, lambda_, forces_.data());
  std::copy(K_.begin(), K_.end(), ws.loop.K.begin());
  const Vec3<double> axis = Vec3<double>::UnitZ();
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const JointPlan<double>& joint = plan.joints[i];
    const JointState<double>& s = ws.joints[i];
    Mat3<double> rotation;
    Vec3<double> position;
    joint_pose(joint, s, rotation, position);
    const Vec3<double> own = turns(joint) ? Vec3<double>(qd[i] * axis) : Vec3<double>::Zero();
    bodies_[i] = {s.omega, s.omega - own, transposed_product(rotation, position), s.acceleration, s.p};
  }
}

// Derivatives of accelerations and wrenches of the bodies outboard of `joint`: (1)-(4) at the joint itself,
// (5) for the others.
inline void Derivatives::set_subtree(const Plan<double>& plan, const Workspace<double>& ws, const double* qd,
                                     int joint, bool velocity) {
  const Vec3<double> axis = Vec3<double>::UnitZ();
  for (std::size_t i = 0; i < changes_.size(); ++i) {
    const JointPlan<double>& at = plan.joints[i];
    const Body& body = bodies_[i];
    Change& change = changes_[i];
    change.wrench = Force<double>::zero();
    change.moved = static_cast<int>(i) == joint || (at.parent != ground && changes_[at.parent].moved);
    if (!change.moved) continue;
    if (static_cast<int>(i) == joint) {
      change.omega.setZero();
      change.acceleration = Motion<double>::zero();
      const Vec3<double> turning = body.omega.cross(axis);
      if (velocity) {
        if (turns(at)) change.omega = axis;
        add_velocity_product(at, turning, change.acceleration);
      } else {
        const Motion<double>& a = body.acceleration;
        if (turns(at)) {
          change.omega = turning;
          change.acceleration = {a.angular.cross(axis), a.linear.cross(axis)};
        }
        if (slides(at))
          change.acceleration.linear += advance(at) * (a.angular.cross(axis) + body.omega.cross(turning));
      }
    } else {
      const Change& parent = changes_[at.parent];
      Motion<double> turned{parent.omega, Vec3<double>::Zero()};
      to_body(at, ws.joints[i], turned);
      change.omega = turned.angular;
      change.acceleration = parent.acceleration;
      to_body(at, ws.joints[i], change.acceleration);
      const Vec3<double>& w = body.omega_carried;
      change.acceleration.linear +=
          change.omega.cross(w.cross(body.arm)) + w.cross(change.omega.cross(body.arm));
      add_velocity_product(at, Vec3<double>(qd[i] * change.omega.cross(axis)), change.acceleration);
    }
    change.wrench = bias_change(at.inertia, body.omega, change.omega);
    add(change.wrench, at.inertia * change.acceleration);
  }
}

// (6)-(8) for an entry of the poses; `parent`: the entry that carries the joint.
Derivatives::GroundChange Derivatives::ground_change(const Plan<double>& plan, const Workspace<double>& ws,
                                                     int joint, int parent, const PoseStep& step,
                                                     bool velocity) const {
  const JointPlan<double>& at = plan.joints[joint];
  const GroundState<double>&carrier = ground_state(ws, parent), &own = ws.ground[joint],
        &g = ws.ground[step.entry];
  const Vec3<double> e = own.rotation.col(2);
  // if the joint moves the body of reference, positions and velocities are relative to that body's origin
  const bool moves_reference = step.reference != ground && changes_[step.reference].moved;
  // displacement of the body per unit of q
  Vec3<double> angular = Vec3<double>::Zero(), shift = angular;
  add_motion(at, e, angular, shift);
  if (moves_reference) shift.setZero();
  if (turns(at)) shift += e.cross(moves_reference ? g.position : Vec3<double>(g.position - own.position));
  GroundChange change;
  if (velocity) {
    change.velocity = shift;
    change.omega = angular;
    return change;
  }
  change.position = shift;
  change.velocity = carrier.omega.cross(shift);
  if (!turns(at)) return change;
  Vec3<double> from = g.position, velocity_from = g.velocity;
  if (!moves_reference) {
    from -= carrier.position;
    velocity_from -= carrier.velocity;
  }
  change.turn = e;
  change.omega = e.cross(g.omega - carrier.omega);
  change.velocity += e.cross(velocity_from - carrier.omega.cross(from));
  return change;
}

// Derivatives of the ground-frame motions of bodies with force elements and loops. Those of bodies that
// neither this nor the previous variable displaces remain zero.
[[gnu::flatten]] void Derivatives::move_ground_states(const Plan<double>& plan, const Workspace<double>& ws,
                                                      int joint, bool velocity) {
  Workspace<Dual>& dual = elements_->workspace;
  int parent = plan.joints[joint].parent;  // entry
  for (const PoseStep& step : plan.poses) {
    if (step.kind != PoseStep::Kind::moved) {
      set_seen_from(step, dual);
      continue;
    }
    if (step.body == joint) parent = step.from;
    GroundChange change;
    const bool moved = changes_[step.body].moved;
    if (moved) change = ground_change(plan, ws, joint, parent, step, velocity);
    char& displaced = displaced_[step.entry];
    if (!moved && displaced == 0) continue;
    displaced = moved;
    const GroundState<double>& g = ws.ground[step.entry];
    GroundState<Dual>& to = dual.ground[step.entry];
    for (int column = 0; column < 3; ++column) {
      const Vec3<double> direction = g.rotation.col(column);
      to.rotation.col(column) = with(direction, change.turn.cross(direction));
    }
    to.position = with(g.position, change.position);
    to.omega = with(g.omega, change.omega);
    to.velocity = with(g.velocity, change.velocity);
  }
}

// Not inlined into the clones, whose size contacts would double. The joint changes the force of a pair, in
// link axes, only if it moves exactly one of the two bodies.
[[gnu::noinline]] void Derivatives::change_contacts() {
  const auto moved = [this](int body) { return body != ground && changes_[body].moved; };
  if constexpr (Plan<Dual>::may_have_contacts) {
    auto& [elements, dual] = *elements_;
    dual.contact_power = Dual(0);
    for (const ContactPair<Dual>& pair : elements.contact_pairs)
      if (moved(pair.sphere_body) != moved(pair.surface_body)) add_contact_wrenches(elements, dual, pair);
  }
}

// Adds the derivatives of the wrenches of springs, bushings, contacts and ports to those of the bodies;
// returns the derivative of the power of springs, bushings and contacts.
inline double Derivatives::set_elements(const Plan<double>& plan) {
  auto& [elements, dual] = *elements_;
  for (auto& s : dual.joints) s.p = Force<Dual>::zero();
  add_spring_wrenches(elements, dual);
  if constexpr (Plan<Dual>::may_have_bushings) add_bushing_wrenches(elements, dual);
  if (elements.has_contacts()) change_contacts();
  add_port_wrenches(elements, dual, port_wrenches_.data());
  for (std::size_t i = 0; i < plan.joints.size(); ++i) add(changes_[i].wrench, change_of(dual.joints[i].p));
  double power = 0;
  for (const auto& spring : elements.springs) {
    const Dual rate = spring_line(spring, dual).rate;
    power -= (spring.damping * rate * rate).derivative;
  }
  if constexpr (Plan<Dual>::may_have_bushings) power += bushing_loss(elements, dual).derivative;
  if constexpr (Plan<Dual>::may_have_contacts) power += dual.contact_power.derivative;
  return power;
}

// Derivatives of the row accelerations phi'' = sum of wrench . acceleration + quadratic part, with opposite
// sign, into ws.loop.b, and of the wrenches at constant lambda. For a velocity the wrenches are constant:
// they keep their values from the position of the same joint, which must precede it among the variables.
void Derivatives::change_loops(const Plan<double>& plan, Workspace<double>& ws, bool velocity) {
  auto& [elements, dual] = *elements_;
  LoopState<Dual>& state = dual.loop;
  for (std::size_t n = 0; n < plan.loops.size(); ++n) {
    const LoopPlan<Dual>& loop = elements.loops[n];
    const int bodies[] = {loop.body_a, loop.body_b, loop.root};
    bool moved = false;
    for (const int body : bodies) moved = moved || (body != ground && changes_[body].moved);
    if (!moved) continue;
    if (velocity)
      set_quadratic_parts(elements, dual, n);
    else
      set_rows_of_loop(elements, dual, n);
    for (std::size_t row = loop.first_row; row < loop.first_row + loop.rows.size(); ++row) {
      const Force<Dual>* const wrenches[] = {&state.wrench[0][row], &state.wrench[1][row], &state.K[row]};
      ws.loop.b[row] = state.b[row].derivative;
      for (int side = 0; side < 3; ++side) change_row(plan, ws, row, bodies[side], *wrenches[side], velocity);
    }
  }
}

// Contribution of the wrench of a row on one body.
void Derivatives::change_row(const Plan<double>& plan, Workspace<double>& ws, std::size_t row, int of,
                             const Force<Dual>& wrench, bool velocity) {
  const Force<double> change = velocity ? Force<double>::zero() : change_of(wrench);
  if (of == ground) {
    ws.loop.b[row] += change.force.dot(plan.gravity);
    return;
  }
  ws.loop.b[row] -= dot(change, bodies_[of].acceleration);
  Change& body = changes_[of];
  for (int k = 0; body.moved && k < 3; ++k)
    ws.loop.b[row] -= wrench.moment[k].value * body.acceleration.angular[k] +
                      wrench.force[k].value * body.acceleration.linear[k];
  body.wrench.moment -= lambda_[row] * change.moment;
  body.wrench.force -= lambda_[row] * change.force;
}

// Leaves to root: (9), derivatives of the joint forces with opposite sign.
inline void Derivatives::collect_forces(const Plan<double>& plan, const Workspace<double>& ws, int joint,
                                        bool velocity) {
  const Vec3<double> axis = Vec3<double>::UnitZ();
  for (int i = plan.nv - 1; i >= 0; --i) {
    const JointPlan<double>& at = plan.joints[i];
    Force<double> f = changes_[i].wrench;
    forces_[i] = -generalized_force(at, f);
    if (at.parent == ground) continue;
    if (i == joint && !velocity) {
      const Force<double>& whole = bodies_[i].wrench;
      if (turns(at)) add(f, {axis.cross(whole.moment), axis.cross(whole.force)});
      if (slides(at)) f.moment += advance(at) * axis.cross(whole.force);
    }
    to_parent(at, ws.joints[i], f);
    add(changes_[at.parent].wrench, f);
  }
}

void Derivatives::evaluate(const Plan<double>& plan, Workspace<double>& ws, const double* q, const double* qd,
                           const double* qdd, const double* tau, const double* ports,
                           const std::vector<JointVariable>& variables, double* columns, std::size_t length) {
  set_point(plan, ws, q, qd, qdd, ports);
  if (elements_) {
    update_contact_laws(plan, elements_->plan);
    std::copy_n(ports, port_wrenches_.size(), port_wrenches_.begin());
    std::fill(displaced_.begin(), displaced_.end(), 1);
  }
  for (std::size_t k = 0; k < variables.size(); ++k) {
    // no structured binding: lambdas cannot capture one in C++17
    const JointVariable::Kind kind = variables[k].kind;
    const int joint = variables[k].joint;
    double* column = columns + k * length;
    double& power = column[plan.nv];
    if (kind == JointVariable::Kind::force) {
      power = qd[joint];
      std::fill(forces_.begin(), forces_.end(), 0.0);
      std::fill(ws.loop.b.begin(), ws.loop.b.end(), 0.0);
      forces_[joint] = 1;
    } else {
      const bool velocity = kind == JointVariable::Kind::velocity;
      const PassiveChange passive = passive_change(plan, joint, q[joint], qd[joint], velocity);
      power = (velocity ? tau[joint] : 0) + passive.loss;
      fastest([&] { set_subtree(plan, ws, qd, joint, velocity); });
      if (elements_) {
        move_ground_states(plan, ws, joint, velocity);
        fastest([&] { power += set_elements(plan); });
      }
      std::fill(ws.loop.b.begin(), ws.loop.b.end(), 0.0);  // rows of couplings do not change
      if (elements_ && plan.has_constraints()) change_loops(plan, ws, velocity);
      fastest([&] { collect_forces(plan, ws, joint, velocity); });
      forces_[joint] += passive.force;
      if (plan.has_elastic_couplings())
        power += change_coupling_forces(plan, joint, q, qd, velocity, forces_);
    }
    respond_fastest(plan, ws, forces_.data(), column);
  }
}

void Derivatives::evaluate_row(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                               const double* qd, const double* qdd, const double* tau, const double* ports,
                               const double* weights, double weight_of_power, Gradient& row) {
  const std::size_t n = bodies_.size();
  row.q.assign(n, 0.0);
  row.qd.assign(n, 0.0);
  row.tau.resize(n);
  row.ports.resize(port_wrenches_.size());
  set_point(plan, ws, q, qd, qdd, ports);
  std::fill(ws.loop.b.begin(), ws.loop.b.end(), 0.0);
  respond_fastest(plan, ws, weights, row.tau.data());
  move_along(plan, ws, row);
  if (elements_) {
    update_contact_laws(plan, elements_->plan);
    std::copy_n(ports, port_wrenches_.size(), port_wrenches_.begin());
    pull_elements(plan, ws, qd, weight_of_power, row);
  }
  if (plan.has_elastic_couplings()) pull_couplings(plan, q, qd, weight_of_power, row);
  sweep_back(plan, ws, qd, row);
  for (std::size_t i = 0; i < n; ++i) {
    const int joint = static_cast<int>(i);
    const PassiveChange by_q = passive_change(plan, joint, q[i], qd[i], false),
                        by_qd = passive_change(plan, joint, q[i], qd[i], true);
    row.q[i] += row.tau[i] * by_q.force + weight_of_power * by_q.loss;
    row.qd[i] += row.tau[i] * by_qd.force + weight_of_power * (tau[i] + by_qd.loss);
    row.tau[i] += weight_of_power * qd[i];
  }
}

}  // namespace redysim
