#pragma once

#include "dynamics/joint_transform.hpp"

// Poses and velocities in the ground frame of the bodies with loops or force elements; wrenches of springs
// and ports.

namespace redysim {

template <class Scalar>
GroundState<Scalar> ground_at_rest() {
  GroundState<Scalar> g;
  g.rotation.setIdentity();
  g.position.setZero();
  g.omega.setZero();
  g.velocity.setZero();
  return g;
}

template <class Scalar>
const GroundState<Scalar>& ground_state(const Workspace<Scalar>& ws, int entry) {
  return entry == ground ? ws.base : ws.ground[entry];
}

// State of a body from its parent's state.
template <class Scalar>
GroundState<Scalar> moved(const JointPlan<Scalar>& joint, const JointState<Scalar>& state,
                          const GroundState<Scalar>& from, const Scalar& qd) {
  Mat3<Scalar> rotation;
  Vec3<Scalar> position;
  joint_pose(joint, state, rotation, position);
  const Vec3<Scalar> arm = product(from.rotation, position);
  GroundState<Scalar> to;
  to.rotation = product(from.rotation, rotation);
  to.position = from.position + arm;
  to.omega = from.omega;
  to.velocity = from.velocity + from.omega.cross(arm);
  add_motion(joint, Vec3<Scalar>(to.rotation.col(2) * qd), to.omega, to.velocity);
  return to;
}

// State of a body relative to another reference.
template <class Scalar>
void set_seen_from(const PoseStep& step, Workspace<Scalar>& ws) {
  const GroundState<Scalar>& from = ws.ground[step.from];
  GroundState<Scalar>& to = ws.ground[step.entry];
  to.rotation = from.rotation;
  to.omega = from.omega;
  if (step.kind == PoseStep::Kind::root) {
    to.position.setZero();
    to.velocity.setZero();
  } else {
    const GroundState<Scalar>& base = ground_state(ws, step.base);
    to.position = from.position + base.position;
    to.velocity = from.velocity + base.velocity;
  }
}

// Fills the required entries of ws.ground. Uses the joint positions in the workspace (set_positions) and qd.
template <class Scalar>
void set_ground_motion(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* qd) {
  for (const PoseStep& step : plan.poses) {
    const int i = step.body;
    if (!features::loops || step.kind == PoseStep::Kind::moved)
      ws.ground[i] = moved(plan.joints[i], ws.joints[i], ground_state(ws, step.from), qd[i]);
    else
      set_seen_from(step, ws);
  }
}

// Motion of a point fixed in a body, in the ground frame.
template <class Scalar>
struct PointMotion {
  Vec3<Scalar> arm, position, velocity;  // arm: from the body's origin, ground axes
};

template <class Scalar>
PointMotion<Scalar> point_motion(const GroundState<Scalar>& body, const Vec3<Scalar>& point) {
  PointMotion<Scalar> m;
  m.arm = product(body.rotation, point);
  m.position = body.position + m.arm;
  m.velocity = body.velocity + body.omega.cross(m.arm);
  return m;
}

// Subtracts a force at `arm` (both in ground axes) from the bias wrench of `body`.
template <class Scalar>
void subtract_force(Workspace<Scalar>& ws, int body, const Vec3<Scalar>& arm, const Vec3<Scalar>& force) {
  if (body == ground) return;
  const Mat3<Scalar>& rotation = ws.ground[body].rotation;
  ws.joints[body].p.moment -= transposed_product<Scalar>(rotation, arm.cross(force));
  ws.joints[body].p.force -= transposed_product(rotation, force);
}

// Line of a spring-damper: length (m) and its rate (m/s), direction from a to b, tension (N).
template <class Scalar>
struct SpringLine {
  PointMotion<Scalar> a, b;
  Vec3<Scalar> direction;
  Scalar length, rate, tension;
};

template <class Scalar>
SpringLine<Scalar> spring_line(const SpringPlan<Scalar>& spring, const Workspace<Scalar>& ws) {
  SpringLine<Scalar> line;
  line.a = point_motion(ground_state(ws, spring.entry_a), spring.point_a);
  line.b = point_motion(ground_state(ws, spring.entry_b), spring.point_b);
  const Vec3<Scalar> between = line.b.position - line.a.position;
  line.length = safe_norm(between);  // the direction between coincident points is zero
  line.direction = between / line.length;
  line.rate = line.direction.dot(line.b.velocity - line.a.velocity);
  line.tension = spring.stiffness * (line.length - spring.rest_length) + spring.damping * line.rate;
  return line;
}

template <class Scalar>
void add_spring_wrench(const SpringPlan<Scalar>& spring, Workspace<Scalar>& ws) {
  const SpringLine<Scalar> line = spring_line(spring, ws);
  const Vec3<Scalar> pull = line.direction * line.tension;
  subtract_force(ws, spring.body_a, line.a.arm, pull);
  subtract_force(ws, spring.body_b, line.b.arm, Vec3<Scalar>(-pull));
}

template <class Scalar>
void add_spring_wrenches(const Plan<Scalar>& plan, Workspace<Scalar>& ws) {
  for (const auto& spring : plan.springs) add_spring_wrench(spring, ws);
}

// Applies a port's wrench to its body. `wrench`: moment (N m) and force (N), 6 numbers.
template <class Scalar>
void add_port_wrench(const PortPlan<Scalar>& port, Workspace<Scalar>& ws, const Scalar* wrench) {
  Vec3<Scalar> moment(wrench[0], wrench[1], wrench[2]), force(wrench[3], wrench[4], wrench[5]);
  if (port.in_ground_axes) {
    moment = transposed_product(ws.ground[port.body].rotation, moment);
    force = transposed_product(ws.ground[port.body].rotation, force);
  } else {
    moment = product(port.rotation, moment);
    force = product(port.rotation, force);
  }
  ws.joints[port.body].p.moment -= moment + port.position.cross(force);
  ws.joints[port.body].p.force -= force;
}

// The same for all ports.
template <class Scalar>
void add_port_wrenches(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* wrenches) {
  for (const auto& port : plan.ports) {
    add_port_wrench(port, ws, wrenches);
    wrenches += 6;
  }
}

// Pose and velocity of any body in the ground frame, recursively from the ground, for outputs. Uses the joint
// states of set_positions.
template <class Scalar>
GroundState<Scalar> body_motion(const Plan<Scalar>& plan, const Workspace<Scalar>& ws, int body,
                                const Scalar* qd) {
  if (body == ground) return ground_at_rest<Scalar>();
  const GroundState<Scalar> from = body_motion(plan, ws, plan.joints[body].parent, qd);
  return moved(plan.joints[body], ws.joints[body], from, qd[body]);
}

template <class Scalar>
struct AcceleratedBody {
  GroundState<Scalar> state;
  Motion<Scalar> acceleration;  // of the origin, in ground axes, without gravity
};

// The same with the acceleration.
template <class Scalar>
AcceleratedBody<Scalar> body_motion(const Plan<Scalar>& plan, const Workspace<Scalar>& ws, int body,
                                    const Scalar* qd, const Scalar* qdd) {
  if (body == ground) return {ground_at_rest<Scalar>(), Motion<Scalar>::zero()};
  const JointPlan<Scalar>& joint = plan.joints[body];
  const auto [from, carried] = body_motion(plan, ws, joint.parent, qd, qdd);
  AcceleratedBody<Scalar> to{moved(joint, ws.joints[body], from, qd[body]), carried};
  Mat3<Scalar> rotation;
  Vec3<Scalar> position;
  joint_pose(joint, ws.joints[body], rotation, position);
  const Vec3<Scalar> arm = product(from.rotation, position), axis = to.state.rotation.col(2);
  to.acceleration.linear +=
      to.acceleration.angular.cross(arm) + from.omega.cross(Vec3<Scalar>(from.omega.cross(arm)));
  add_velocity_product(joint, Vec3<Scalar>(from.omega.cross(axis) * qd[body]), to.acceleration);
  add_motion(joint, Vec3<Scalar>(axis * qdd[body]), to.acceleration.angular, to.acceleration.linear);
  return to;
}

// Acceleration of a point fixed in a body, in ground axes. `arm`: from the body's origin, in ground axes.
template <class Scalar>
Vec3<Scalar> point_acceleration(const AcceleratedBody<Scalar>& body, const Vec3<Scalar>& arm) {
  const Vec3<Scalar>& omega = body.state.omega;
  return body.acceleration.linear + body.acceleration.angular.cross(arm) +
         omega.cross(Vec3<Scalar>(omega.cross(arm)));
}

}  // namespace redysim
