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

// What the parent feels: A - U U^T / D and p + A_reduced c + U u / D.
template <class Scalar>
void reduce(JointState<Scalar>& s) {
  const Vec3<Scalar> n = s.U.moment, g = s.D_inverse * s.U.moment;
  const Vec3<Scalar> f = s.U.force, h = s.D_inverse * s.U.force;
  s.A.I.xx -= n.x() * g.x();
  s.A.I.yy -= n.y() * g.y();
  s.A.I.zz -= n.z() * g.z();
  s.A.I.xy -= n.x() * g.y();
  s.A.I.xz -= n.x() * g.z();
  s.A.I.yz -= n.y() * g.z();
  for (int column = 0; column < 3; ++column) s.A.H.col(column) -= g * f[column];
  s.A.M.xx -= f.x() * h.x();
  s.A.M.yy -= f.y() * h.y();
  s.A.M.zz -= f.z() * h.z();
  s.A.M.xy -= f.x() * h.y();
  s.A.M.xz -= f.x() * h.z();
  s.A.M.yz -= f.y() * h.z();
  const Force<Scalar> by_c = s.A * s.c;
  s.p.moment += by_c.moment + g * s.u;
  s.p.force += by_c.force + h * s.u;
}

// Leaves to root: one joint, folded into its parent's body.
template <class Scalar>
void eliminate(const Plan<Scalar>& plan, Workspace<Scalar>& ws, int i, const Scalar* q,
                             const Scalar* qd, const Scalar* tau) {
  const JointPlan<Scalar>& joint = plan.joints[i];
  JointState<Scalar>& s = ws.joints[i];
  set_pivot(joint, s, joint_force(joint, q[i], qd[i], tau[i]));
  if (joint.parent == ground) return;
  reduce(s);
  JointState<Scalar>& parent = ws.joints[joint.parent];
  ArticulatedInertia<Scalar> A = s.A;
  Force<Scalar> p = s.p;
  to_parent(joint, s, A);
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
  Motion<Scalar> a;
  if (joint.parent != ground)
    a = ws.joints[joint.parent].acceleration;
  else if (!at_rest)
    a.linear = -plan.gravity;
  to_body(joint, s, a);
  if (!at_rest) {
    a.angular += s.c.angular;
    a.linear += s.c.linear;
  }
  qdd[i] = (s.u + from_loops - dot(s.U, a)) * s.D_inverse;
  (joint.prismatic ? a.linear : a.angular).z() += qdd[i];
  s.acceleration = a;
}

}  // namespace redysim
