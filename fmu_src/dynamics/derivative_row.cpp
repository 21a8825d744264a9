#include <algorithm>

#include "dynamics/changes.hpp"
#include "dynamics/derivatives.hpp"
#include "dynamics/joint_wrenches.hpp"

// One row of the derivatives. Equation numbers: docs/derivations/derivatives.md.

namespace redysim {

// (10)-(11), root to leaves. `row.tau` holds lambda. Sets the motion of each body along lambda and the
// weights of changes of its omega and acceleration; subtracts derivatives of the inverse dynamics from
// `row.q`, `row.qd`.
[[gnu::flatten]] void Derivatives::move_along(const Plan<double>& plan, const Workspace<double>& ws,
                                              Gradient& row) {
  const Vec3<double> axis = Vec3<double>::UnitZ();
  for (std::size_t i = 0; i < changes_.size(); ++i) {
    const JointPlan<double>& at = plan.joints[i];
    const Body& body = bodies_[i];
    Motion<double> v = Motion<double>::zero();
    if (at.parent != ground) v = changes_[at.parent].acceleration;
    to_body(at, ws.joints[i], v);
    const Force<double>& whole = body.wrench;
    if (turns(at))
      row.q[i] -= v.angular.dot(axis.cross(whole.moment)) + v.linear.dot(axis.cross(whole.force));
    if (slides(at)) row.q[i] -= advance(at) * v.angular.dot(axis.cross(whole.force));
    add_motion(at, row.tau[i], v);
    changes_[i].acceleration = v;
    changes_[i].wrench = at.inertia * v;
    const Vec3<double>& h = at.inertia.h;
    changes_[i].omega = (at.inertia.inertia * body.omega).cross(v.angular) +
                        at.inertia.inertia * v.angular.cross(body.omega) + body.omega.dot(h) * v.linear +
                        v.linear.dot(body.omega) * h - 2 * v.linear.dot(h) * body.omega;
  }
}

// (12), leaves to root: adds the weights of each body's motion to those of its parent.
[[gnu::flatten]] void Derivatives::sweep_back(const Plan<double>& plan, const Workspace<double>& ws,
                                              const double* qd, Gradient& row) {
  const Vec3<double> axis = Vec3<double>::UnitZ();
  for (std::size_t i = changes_.size(); i-- > 0;) {
    const JointPlan<double>& at = plan.joints[i];
    const Body& body = bodies_[i];
    const Motion<double>& a = body.acceleration;
    Force<double> f = changes_[i].wrench;
    Vec3<double> g = changes_[i].omega;
    const Vec3<double> turning = body.omega.cross(axis);
    Vec3<double> product = 2 * advance(at) * f.force;
    if (turns(at)) {
      product += f.moment;
      row.q[i] -= g.dot(turning) + f.moment.dot(a.angular.cross(axis)) + f.force.dot(a.linear.cross(axis));
      row.qd[i] -= g.z();
    }
    if (slides(at)) row.q[i] -= advance(at) * f.force.dot(a.angular.cross(axis) + body.omega.cross(turning));
    row.qd[i] -= product.dot(turning);
    if (at.parent == ground) continue;
    const Vec3<double>& w = body.omega_carried;
    g += w.cross(body.arm).cross(f.force) + body.arm.cross(f.force.cross(w)) + qd[i] * axis.cross(product);
    Force<double> turned{g, Vec3<double>::Zero()};
    to_parent(at, ws.joints[i], turned);
    to_parent(at, ws.joints[i], f);
    changes_[at.parent].omega += turned.moment;
    add(changes_[at.parent].wrench, f);
  }
}

// Change of one element's wrenches times the motions along lambda, plus the change of its power times
// `weight`.
[[gnu::cold]] double Derivatives::change_of_element(const Element& element, const Workspace<double>& ws,
                                                    double weight) {
  auto& [elements, dual] = *elements_;
  for (int body : element.bodies)
    if (body != ground) dual.joints[body].p = Force<Dual>::zero();
  double sum = 0;
  switch (element.kind) {
    case Element::Kind::spring: {
      const SpringPlan<Dual>& spring = elements.springs[element.index];
      add_spring_wrench(spring, dual);
      const Dual rate = spring_line(spring, dual).rate;
      sum = -weight * (spring.damping * rate * rate).derivative;
      break;
    }
    case Element::Kind::bushing:
      if constexpr (Plan<Dual>::may_have_bushings) {
        const BushingPlan<Dual>& bushing = elements.bushings[element.index];
        add_bushing_wrench(bushing, dual);
        sum = weight * bushing_loss(bushing, dual).derivative;
      }
      break;
    case Element::Kind::contact:
      if constexpr (Plan<Dual>::may_have_contacts) {
        dual.contact_power = Dual(0);
        add_contact_wrenches(elements, dual, elements.contact_pairs[element.index]);
        sum = weight * dual.contact_power.derivative;
      }
      break;
    case Element::Kind::port:
      add_port_wrench(elements.ports[element.index], dual, &port_wrenches_[6 * element.index]);
      break;
    case Element::Kind::loop:
      return change_of_loop(element, ws);
  }
  for (int body : element.bodies)
    if (body != ground) sum -= dot(change_of(dual.joints[body].p), changes_[body].acceleration);
  return sum;
}

// The same for a loop: its wrenches change at constant multipliers, its rows are multiplied by the
// multipliers of lambda.
[[gnu::cold]] double Derivatives::change_of_loop(const Element& element, const Workspace<double>& ws) {
  auto& [elements, dual] = *elements_;
  const LoopPlan<Dual>& loop = elements.loops[element.index];
  LoopState<Dual>& state = dual.loop;
  set_rows_of_loop(elements, dual, element.index);
  double sum = 0;
  for (std::size_t row = loop.first_row; row < loop.first_row + loop.rows.size(); ++row) {
    const double weight = ws.loop.lambda[row];
    const Force<Dual>* const wrenches[] = {&state.wrench[0][row], &state.wrench[1][row], &state.K[row]};
    sum -= weight * state.b[row].derivative;
    for (int side = 0; side < 3; ++side) {
      const Force<double> change = change_of(*wrenches[side]);
      const int body = element.bodies[side];
      if (body == ground)
        sum -= weight * change.force.dot(gravity_);
      else
        sum += weight * dot(change, bodies_[body].acceleration) +
               lambda_[row] * dot(change, changes_[body].acceleration);
    }
  }
  return sum;
}

// Weights of the twelve changes of motion (ground axes) of each entry of an element.
[[gnu::cold]] void Derivatives::pull_element(const Element& element, const Workspace<double>& ws,
                                             double weight) {
  Workspace<Dual>& dual = elements_->workspace;
  for (int side = 0; side < 3; ++side) {
    const int body = element.bodies[side], entry = element.entries[side];
    if (body == ground || std::find(element.entries, element.entries + side, entry) != element.entries + side)
      continue;
    const GroundState<Dual> held = dual.ground[entry];
    Mat3<Dual>& own = dual.ground[body].rotation;
    for (int k = 0; k < 12; ++k) {
      GroundState<Dual>& at = dual.ground[entry];
      at = held;
      Vec3<double> unit = Vec3<double>::Unit(k % 3);
      Vec3<Dual>* const linear[] = {nullptr, &at.position, &at.omega, &at.velocity};
      if (k < 3)
        for (int column = 0; column < 3; ++column) {
          const Vec3<double> direction = ws.ground[entry].rotation.col(column);
          at.rotation.col(column) = with(direction, unit.cross(direction));
        }
      else
        (*linear[k / 3])[k % 3].derivative = 1;
      own = at.rotation;
      pulled_[entry].of[k / 3][k % 3] += change_of_element(element, ws, weight);
    }
    dual.ground[entry] = held;
    own = held.rotation;
  }
}

// Weights of the bodies' accelerations, which change the rows of a loop. Uses the rows in the elements'
// workspace.
[[gnu::cold]] void Derivatives::weigh_loop(const Element& element, const Workspace<double>& ws) {
  const LoopPlan<Dual>& loop = elements_->plan.loops[element.index];
  const LoopState<Dual>& state = elements_->workspace.loop;
  for (std::size_t row = loop.first_row; row < loop.first_row + loop.rows.size(); ++row) {
    const Force<Dual>* const wrenches[] = {&state.wrench[0][row], &state.wrench[1][row], &state.K[row]};
    for (int side = 0; side < 3; ++side) {
      if (element.bodies[side] == ground) continue;
      Force<double>& to = changes_[element.bodies[side]].wrench;
      for (int k = 0; k < 3; ++k) {
        to.moment[k] -= ws.loop.lambda[row] * wrenches[side]->moment[k].value;
        to.force[k] -= ws.loop.lambda[row] * wrenches[side]->force[k].value;
      }
    }
  }
}

// Weights of all elements, then the transpose of set_ground_motion.
[[gnu::cold]] void Derivatives::pull_elements(const Plan<double>& plan, const Workspace<double>& ws,
                                              const double* qd, double weight, Gradient& row) {
  using Kind = Element::Kind;
  for (std::size_t i = 0; i < ws.ground.size(); ++i) {
    const GroundState<double>& from = ws.ground[i];
    elements_->workspace.ground[i] = {from.rotation.cast<Dual>(), from.position.cast<Dual>(),
                                      from.omega.cast<Dual>(), from.velocity.cast<Dual>()};
  }
  pulled_.assign(ws.ground.size(), Pulled());
  gravity_ = plan.gravity;
  const auto pull = [&](Kind kind, std::size_t k, int a, int b, int entry_a, int entry_b) {
    pull_element({kind, k, {a, b, ground}, {entry_a, entry_b, ground}}, ws, weight);
  };
  for (std::size_t k = 0; k < plan.springs.size(); ++k) {
    const SpringPlan<double>& s = plan.springs[k];
    pull(Kind::spring, k, s.body_a, s.body_b, s.entry_a, s.entry_b);
  }
  for (std::size_t k = 0; k < plan.bushings.size(); ++k) {
    const BushingPlan<double>& b = plan.bushings[k];
    pull(Kind::bushing, k, b.body_a, b.body_b, b.entry_a, b.entry_b);
  }
  for (std::size_t k = 0; k < plan.contact_pairs.size(); ++k) {
    const ContactPair<double>& c = plan.contact_pairs[k];
    pull(Kind::contact, k, c.sphere_body, c.surface_body, c.sphere_entry, c.surface_entry);
  }
  for (std::size_t k = 0; k < plan.ports.size(); ++k) {
    const PortPlan<double>& port = plan.ports[k];
    const Motion<double>& v = changes_[port.body].acceleration;
    const Vec3<double> parts[] = {v.angular, v.linear + v.angular.cross(port.position)};
    const Mat3<double> axes =
        port.in_ground_axes ? ws.ground[port.body].rotation : Mat3<double>(port.rotation.transpose());
    for (int i = 0; i < 6; ++i) row.ports[6 * k + i] = axes.row(i % 3).dot(parts[i / 3]);
    if (port.in_ground_axes) pull(Kind::port, k, port.body, ground, port.entry, ground);
  }
  for (std::size_t k = 0; k < plan.loops.size(); ++k) {
    const LoopPlan<double>& l = plan.loops[k];
    const Element element{Kind::loop, k, {l.body_a, l.body_b, l.root}, {l.entry_a, l.entry_b, l.entry_root}};
    pull_element(element, ws, weight);
    weigh_loop(element, ws);
  }
  push_ground_weights(plan, ws, qd, row);
}

[[gnu::cold]] void Derivatives::push_ground_weights(const Plan<double>& plan, const Workspace<double>& ws,
                                                    const double* qd, Gradient& row) {
  Pulled nowhere;
  const auto weights = [&](int entry) -> Pulled& { return entry == ground ? nowhere : pulled_[entry]; };
  for (std::size_t k = plan.poses.size(); k-- > 0;) {
    const PoseStep& step = plan.poses[k];
    const auto& [turn, shift, omega, rate] = weights(step.entry).of;
    Pulled& from = weights(step.from);
    from.of[2] += omega;
    if (step.kind != PoseStep::Kind::moved) {
      from.of[0] += turn;
      if (step.kind == PoseStep::Kind::root) continue;
      for (Pulled* to : {&from, &weights(step.base)}) {
        to->of[1] += shift;
        to->of[3] += rate;
      }
      continue;
    }
    const int i = step.body;
    const JointPlan<double>& joint = plan.joints[i];
    const GroundState<double>&carrier = ground_state(ws, step.from), &own = ws.ground[i];
    const Vec3<double> e = own.rotation.col(2), arm = own.position - carrier.position;
    const Vec3<double> whole = shift + rate.cross(carrier.omega);
    Vec3<double> along = advance(joint) * rate;
    row.q[i] += advance(joint) * whole.dot(e);
    if (turns(joint)) {
      row.q[i] += turn.dot(e);
      along += omega;
    }
    row.qd[i] += along.dot(e);
    from.of[0] += turn + arm.cross(whole) + qd[i] * e.cross(along);
    from.of[1] += shift;
    from.of[2] += arm.cross(rate);
    from.of[3] += rate;
  }
}

// Elastic couplings: their forces on the joints, and their dissipation.
[[gnu::cold]] void Derivatives::pull_couplings(const Plan<double>& plan, const double* q, const double* qd,
                                               double weight, Gradient& row) {
  for (const ElasticCouplingPlan& coupling : plan.elastic_couplings) {
    const double y = coupling_sum(coupling, q, coupling.offset), rate = coupling_sum(coupling, qd, 0.0);
    const double along = coupling_sum(coupling, row.tau.data(), 0.0);
    for (const bool velocity : {false, true}) {
      const ElasticForce<Dual> change(coupling, Dual(y, velocity ? 0 : 1), Dual(rate, velocity ? 1 : 0));
      const double product = weight * change.loss.derivative - along * change.sum().derivative;
      for (std::size_t k = 0; k < coupling.joints.size(); ++k)
        (velocity ? row.qd : row.q)[coupling.joints[k]] += coupling.ratios[k] * product;
    }
  }
}

}  // namespace redysim
