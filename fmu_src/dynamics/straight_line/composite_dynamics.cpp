#include "dynamics/straight_line/composite_dynamics.hpp"

#include <utility>
#include <vector>

#include "dynamics/crba.hpp"
#include "dynamics/input_layout.hpp"
#include "dynamics/rnea.hpp"

namespace redysim {
namespace {

bool is_constant(const RigidInertia<Recorded>& body) {
  const Symmetric3<Recorded>& I = body.inertia;
  for (const Recorded* part :
       {&body.mass, &body.h[0], &body.h[1], &body.h[2], &I.xx, &I.yy, &I.zz, &I.xy, &I.xz, &I.yz})
    if (!part->is_constant()) return false;
  return true;
}

// Maximum inertia of a body across its joint axis, relative to the parent's inertia about the parent's axis:
// beyond it, their sum loses accuracy, since the part that a rotation of the body removes again exceeds the
// rest.
constexpr double largest_share = 1e3;

// Removes from a body the part that moves like its parent, and returns it: masses on the axis of a rotation;
// inertia without mass if the joint is prismatic.
RigidInertia<Recorded> taken_from(JointPlan<Recorded>& joint, const JointPlan<Recorded>* parent) {
  RigidInertia<Recorded> part, &body = joint.inertia;
  if (joint.subspace == Subspace::helix || !is_constant(body)) return part;
  if (joint.subspace == Subspace::translation) {
    std::swap(part.inertia, body.inertia);
    return part;
  }
  if (parent && turns(*parent)) {
    const Recorded own = parent->inertia.inertia.zz + parent->armature;
    if (!own.is_constant() || abs(body.inertia.yy) > Recorded(largest_share) * own) return part;
  }
  std::swap(part.mass, body.mass);
  std::swap(part.h.z(), body.h.z());
  part.inertia.xx = part.inertia.yy = body.inertia.yy;
  body.inertia.xx -= body.inertia.yy;
  body.inertia.yy = Recorded(0);
  return part;
}

void set_spread(const Vec3<Recorded>& omega, BodyAcceleration& a) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    a.U(i, i) = -(omega[j] * omega[j] + omega[k] * omega[k]);
    a.U(k, j) = omega[j] * omega[k] + a.angular[i];
    a.U(j, k) = omega[j] * omega[k] - a.angular[i];
  }
}

// Wrench that accelerates a single body: I alpha + omega x I omega + h x a and m a + U h, with products of
// velocities taken from U (Khalil and Kleinfinger 1987).
Force<Recorded> wrench(const RigidInertia<Recorded>& body, const Vec3<Recorded>& omega,
                       const BodyAcceleration& a) {
  const Symmetric3<Recorded>& I = body.inertia;
  const Recorded diagonal[] = {I.xx, I.yy, I.zz}, opposite[] = {I.yz, I.xz, I.xy};
  Vec3<Recorded> moment;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    moment[i] = diagonal[i] * a.angular[i] + (diagonal[k] - diagonal[j]) * (omega[j] * omega[k]) +
                opposite[i] * (omega[j] * omega[j] - omega[k] * omega[k]) + opposite[j] * a.U(j, i) -
                opposite[k] * a.U(k, i);
  }
  return {moment + body.h.cross(a.linear), body.mass * a.linear + product(a.U, body.h)};
}

BodyAcceleration moved_at_rest(const JointPlan<Recorded>& joint, const JointState<Recorded>& s,
                               const BodyAcceleration& parent, const Recorded& qd, const Recorded& qdd) {
  Mat3<Recorded> rotation;
  Vec3<Recorded> position;
  joint_pose(joint, s, rotation, position);
  Motion<Recorded> turned{parent.angular, parent.linear + product(parent.U, position)};
  turn_to_body(joint, s, turned);
  const Vec3<Recorded> product_of_rates(qd * s.omega.y(), -qd * s.omega.x(), Recorded(0));
  add_velocity_product(joint, product_of_rates, turned);
  add_motion(joint, qdd, turned);
  BodyAcceleration a{turned.angular, turned.linear};
  set_spread(s.omega, a);
  return a;
}

// Accelerations (nv) of the prescribed joints, otherwise 0.
std::vector<Recorded> prescribed_accelerations(const Plan<Recorded>& plan, const Recorded* inputs) {
  std::vector<Recorded> qdd(plan.joints.size());
  for (std::size_t i = 0; i < qdd.size(); ++i)
    if (plan.joints[i].prescribed) qdd[i] = inputs[i];
  return qdd;
}

// TreeEquations::at_rest. Sets positions, velocities and the wrenches that accelerate the single bodies.
std::vector<BodyAcceleration> accelerations_at_rest(const Plan<Recorded>& plan, Workspace<Recorded>& ws,
                                                    const Recorded* q, const Recorded* qd,
                                                    const Recorded* inputs) {
  set_positions(plan, ws, q);
  set_velocities(plan, ws, qd);
  BodyAcceleration base;
  base.linear = -plan.gravity;
  const std::vector<Recorded> qdd = prescribed_accelerations(plan, inputs);
  std::vector<BodyAcceleration> bodies;
  for (std::size_t i = 0; i < plan.joints.size(); ++i) {
    const JointPlan<Recorded>& joint = plan.joints[i];
    const BodyAcceleration& parent =
        joint.parent == ground ? base : bodies[static_cast<std::size_t>(joint.parent)];
    bodies.push_back(moved_at_rest(joint, ws.joints[i], parent, qd[i], qdd[i]));
    ws.joints[i].p = wrench(joint.inertia, ws.joints[i].omega, bodies.back());
  }
  return bodies;
}

// Joint forces (nv) for the wrenches in the workspace and the force elements.
std::vector<Recorded> bias_forces(const Plan<Recorded>& plan, Workspace<Recorded>& ws, const Recorded* q,
                                  const Recorded* qd, const Recorded* inputs) {
  std::vector<Recorded> tau(plan.joints.size());
  add_forces_between_bodies(plan, ws, q, qd);
  add_port_wrenches(plan, ws, InputLayout(plan).port_wrench.of(inputs));
  collect_joint_forces(plan, ws, q, qd, prescribed_accelerations(plan, inputs).data(), tau.data());
  return tau;
}

RecordedMatrix inertia(const Plan<Recorded>& plan, Workspace<Recorded>& ws, const Recorded* q) {
  RecordedMatrix M(plan.nv, plan.nv);
  joint_space_inertia<Recorded>(plan, ws, q, M);
  return M;
}

}  // namespace

Plan<Recorded> with_base_parameters(Plan<Recorded> plan, Workspace<Recorded>& ws, const Recorded* q) {
  set_positions(plan, ws, q);
  for (int i = plan.nv - 1; i >= 0; --i) {
    JointPlan<Recorded>& joint = plan.joints[i];
    JointPlan<Recorded>* parent = joint.parent == ground ? nullptr : &plan.joints[joint.parent];
    RigidInertia<Recorded> part = taken_from(joint, parent);
    if (!parent) continue;
    to_parent(joint, ws.joints[i], part);
    add(parent->inertia, part);
  }
  return plan;
}

TreeFactor::TreeFactor(const Plan<Recorded>& plan, RecordedMatrix M) : plan_(plan), L_(std::move(M)) {
  for (int k = plan.nv - 1; k >= 0; --k) {
    if (plan.joints[k].prescribed) {
      L_.row(k).setZero();
      continue;
    }
    L_(k, k) = Recorded(1) / L_(k, k);
    for (int i = parent(k); i != ground; i = parent(i)) {
      const Recorded entry = L_(k, i) * L_(k, k);
      for (int j = i; j != ground; j = parent(j)) L_(i, j) -= entry * L_(k, j);
      L_(k, i) = entry;
    }
  }
}

int TreeFactor::parent(int i) const {
  do i = plan_.joints[i].parent;
  while (i != ground && plan_.joints[i].prescribed);
  return i;
}

void TreeFactor::eliminate(Recorded* forces) const {
  for (int k = plan_.nv - 1; k >= 0; --k) {
    if (plan_.joints[k].prescribed) forces[k] = 0;
    for (int i = parent(k); i != ground; i = parent(i)) forces[i] -= L_(k, i) * forces[k];
  }
}

void TreeFactor::substitute(Recorded* forces) const {
  for (int k = 0; k < plan_.nv; ++k) {
    forces[k] *= inverse_pivot(k);
    for (int i = parent(k); i != ground; i = parent(i)) forces[k] -= L_(k, i) * forces[i];
  }
}

TreeEquations::TreeEquations(const Plan<Recorded>& plan, Workspace<Recorded>& ws, const Recorded* q,
                             const Recorded* qd, const Recorded* inputs)
    : at_rest(accelerations_at_rest(plan, ws, q, qd, inputs)),
      bias(bias_forces(plan, ws, q, qd, inputs)),
      M(inertia(plan, ws, q)),
      factor(plan, M) {}

}  // namespace redysim
