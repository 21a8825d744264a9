#pragma once

#include "dynamics/bias.hpp"

// One step of the forward-dynamics recursion, in both directions.
//
// Legend, DeNOC letters of the seed's Fig. 2: A_ij = to_body, N (p) = z axis of the body, M-hat = A,
// psi-hat = U, m-hat = 1/D_inverse, phi-hat = u, eta = p, mu = acceleration.

namespace redysim {

// U = A S, 1/D and u of one joint.
template <class Scalar>
void set_pivot(const JointPlan<Scalar>& joint, JointState<Scalar>& s, const Scalar& tau) {
  if (joint.prismatic) {
    s.U.moment = s.A.H.col(2);
    s.U.force = {s.A.M.xz, s.A.M.yz, s.A.M.zz};
    s.D_inverse = Scalar(1) / (s.A.M.zz + joint.armature);
    s.u = tau - s.p.force.z();
  } else {
    s.U.moment = {s.A.I.xz, s.A.I.yz, s.A.I.zz};
    s.U.force = s.A.H.row(2).transpose();
    s.D_inverse = Scalar(1) / (s.A.I.zz + joint.armature);
    s.u = tau - s.p.moment.z();
  }
}

// A prescribed joint yields to nothing: 1/D = 0, and its acceleration belongs to c.
template <class Scalar>
void prescribe(const JointPlan<Scalar>& joint, JointState<Scalar>& s, const Scalar& qdd) {
  s.D_inverse = s.u = Scalar(0);
  (joint.prismatic ? s.c.linear : s.c.angular).z() += qdd;
}

// What the parent feels: A - U U^T / D and p + A_reduced c + U u / D.
template <class Scalar>
void reduce(const JointState<Scalar>& s, ArticulatedInertia<Scalar>& A, Force<Scalar>& p) {
  const Vec3<Scalar> n = s.U.moment, g = s.D_inverse * s.U.moment;
  const Vec3<Scalar> f = s.U.force, h = s.D_inverse * s.U.force;
  A.I = {s.A.I.xx - n.x() * g.x(), s.A.I.yy - n.y() * g.y(), s.A.I.zz - n.z() * g.z(),
         s.A.I.xy - n.x() * g.y(), s.A.I.xz - n.x() * g.z(), s.A.I.yz - n.y() * g.z()};
  for (int column = 0; column < 3; ++column) A.H.col(column) = s.A.H.col(column) - g * f[column];
  A.M = {s.A.M.xx - f.x() * h.x(), s.A.M.yy - f.y() * h.y(), s.A.M.zz - f.z() * h.z(),
         s.A.M.xy - f.x() * h.y(), s.A.M.xz - f.x() * h.z(), s.A.M.yz - f.y() * h.z()};
  p = A * s.c;
  p.moment += s.p.moment + g * s.u;
  p.force += s.p.force + h * s.u;
}

// The same behind a revolute joint without armature: nothing is left about z, and c has no part about z.
template <class Scalar>
void reduce_free(const JointState<Scalar>& s, const Scalar& tau, ArticulatedInertia<Scalar>& A,
                 Force<Scalar>& p) {
  const Scalar nx = s.U.moment.x(), ny = s.U.moment.y();
  const Scalar gx = s.D_inverse * nx, gy = s.D_inverse * ny;
  const Vec3<Scalar> f = s.U.force, h = s.D_inverse * s.U.force;
  A.I = {s.A.I.xx - nx * gx, s.A.I.yy - ny * gy, Scalar(0), s.A.I.xy - nx * gy, Scalar(0), Scalar(0)};
  for (int column = 0; column < 3; ++column) {
    A.H(0, column) = s.A.H(0, column) - gx * f[column];
    A.H(1, column) = s.A.H(1, column) - gy * f[column];
    A.H(2, column) = Scalar(0);
  }
  A.M = {s.A.M.xx - f.x() * h.x(), s.A.M.yy - f.y() * h.y(), s.A.M.zz - f.z() * h.z(),
         s.A.M.xy - f.x() * h.y(), s.A.M.xz - f.x() * h.z(), s.A.M.yz - f.y() * h.z()};
  const Scalar cx = s.c.angular.x(), cy = s.c.angular.y();
  const Vec3<Scalar>& c = s.c.linear;
  p.moment.x() = s.p.moment.x() + A.I.xx * cx + A.I.xy * cy + A.H.row(0).dot(c) + gx * s.u;
  p.moment.y() = s.p.moment.y() + A.I.xy * cx + A.I.yy * cy + A.H.row(1).dot(c) + gy * s.u;
  p.moment.z() = tau;
  p.force = s.p.force + A.H.row(0).transpose() * cx + A.H.row(1).transpose() * cy + A.M * c + h * s.u;
}

// Leaves to root: one joint, folded into its parent's body.
template <class Scalar>
void eliminate(const Plan<Scalar>& plan, Workspace<Scalar>& ws, int i, const Scalar* q, const Scalar* qd,
               const Scalar* tau) {
  const JointPlan<Scalar>& joint = plan.joints[i];
  JointState<Scalar>& s = ws.joints[i];
  const Scalar force = joint_force(joint, q[i], qd[i], tau[i]);
  set_pivot(joint, s, force);
  if (joint.prescribed) prescribe(joint, s, tau[i]);
  if (joint.parent == ground) return;
  JointState<Scalar>& parent = ws.joints[joint.parent];
  ArticulatedInertia<Scalar> A;
  Force<Scalar> p;
  if (joint.axis_free) {
    reduce_free(s, force, A, p);
    to_parent<true>(joint, s, A);
  } else {
    reduce(s, A, p);
    to_parent<false>(joint, s, A);
  }
  to_parent(joint, s, p);
  add(parent.A, A);
  add(parent.p, p);
}

// Root to leaves: acceleration of one joint; `from_loops` is what multipliers add to u. At rest: without
// gravity and velocity products, the response to u alone.
template <class Scalar>
void accelerate_joint(const Plan<Scalar>& plan, Workspace<Scalar>& ws, int i, Scalar* qdd,
                      const Scalar& from_loops, bool at_rest = false) {
  const JointPlan<Scalar>& joint = plan.joints[i];
  JointState<Scalar>& s = ws.joints[i];
  Motion<Scalar> a = joint.parent != ground ? ws.joints[joint.parent].acceleration : Motion<Scalar>::zero();
  if (joint.parent == ground && !at_rest) a.linear = -plan.gravity;
  to_body(joint, s, a);
  if (!at_rest) {
    a.angular += s.c.angular;
    a.linear += s.c.linear;
  }
  qdd[i] = (s.u + from_loops - dot(s.U, a)) * s.D_inverse;
  (joint.prismatic ? a.linear : a.angular).z() += qdd[i];
  s.acceleration = a;
  if (joint.prescribed) s.u = from_loops;
}

// What a prescribed joint's drive must give (N m or N) after forward_dynamics at the same q, qd, qdd.
template <class Scalar>
Scalar prescribed_force(const JointPlan<Scalar>& joint, const JointState<Scalar>& s, const Scalar& q,
                        const Scalar& qd, const Scalar& qdd) {
  const Scalar along = joint.prismatic ? s.p.force.z() : s.p.moment.z();
  return dot(s.U, s.acceleration) + along - s.u + joint.armature * qdd - joint_force(joint, q, qd, Scalar(0));
}

}  // namespace redysim
