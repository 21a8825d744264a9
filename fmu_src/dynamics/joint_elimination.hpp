#pragma once

#include "dynamics/bias.hpp"

// One joint of the forward-dynamics recursion, in both directions.
//
// Legend, DeNOC letters of Fig. 2 of the ReDySim paper: A_ij = to_body, N (p) = S, M-hat = A,
// psi-hat = U, m-hat = 1/D_inverse, phi-hat = u, eta = p, mu = acceleration.

namespace redysim {

// U = A S, 1/D and u of one joint; returns A S.
template <class Scalar>
REDYSIM_INLINE InertiaColumn<Scalar> set_pivot(const JointPlan<Scalar>& joint, JointState<Scalar>& s,
                                               const Scalar& force) {
  const InertiaColumn<Scalar> column = inertia_column(joint, s.A);
  s.U = {{column.x[0], column.y[0], column.z[0]}, {column.x[1], column.y[1], column.z[1]}};
  s.D_inverse = Scalar(1) / (axis_inertia(joint, s.A.zz) + joint.armature);
  s.u = force - generalized_force(joint, s.p);
  return column;
}

// Treats a prescribed joint as rigid: 1/D = 0, and its acceleration is added to c.
template <class Scalar>
void prescribe(const JointPlan<Scalar>& joint, JointState<Scalar>& s, const Scalar& qdd) {
  s.D_inverse = s.u = Scalar(0);
  add_motion(joint, qdd, s.c);
}

// Articulated inertia and bias wrench transmitted to the parent: A_reduced = A - U U^T / D and p + A_reduced
// c + U u / D. A rotational joint without armature transmits only the joint force about z; the entries of A
// for its axis are set to exactly zero, so that massless bodies keep zero inertia.
template <class Scalar>
REDYSIM_INLINE void reduce(const JointPlan<Scalar>& joint, const JointState<Scalar>& s,
                           const InertiaColumn<Scalar>& column, const Scalar& force,
                           ArticulatedInertia<Scalar>& A, Force<Scalar>& p) {
  using L = Lanes<Scalar>;
  // per row: right = [n f f n], left = [n f n f] (n moment, f force); the lanes of left * right are n n, f f,
  // n f, f n
  const L &right_x = column.x, &right_y = column.y, &right_z = column.z;
  const L left_x = s.D_inverse * permuted<0, 1, 0, 1>(right_x),
          left_y = s.D_inverse * permuted<0, 1, 0, 1>(right_y),
          left_z = s.D_inverse * permuted<0, 1, 0, 1>(right_z);
  A.xx = s.A.xx - left_x * right_x;
  A.yy = s.A.yy - left_y * right_y;
  A.xy = s.A.xy - left_x * right_y;
  A.xz = s.A.xz - left_x * right_z;
  A.yz = s.A.yz - left_y * right_z;
  A.zz = s.A.zz - left_z * right_z;
  if (joint.axis_free) {
    A.xz = kept<false, true, true, false>(A.xz);
    A.yz = kept<false, true, true, false>(A.yz);
    A.zz = kept<false, true, false, false>(A.zz);
  }
  p = A * s.c;
  p.moment += s.p.moment + s.u * Vec3<Scalar>(left_x[0], left_y[0], left_z[0]);
  p.force += s.p.force + s.u * Vec3<Scalar>(left_x[1], left_y[1], left_z[1]);
  if (joint.axis_free) p.moment.z() = force;
}

// Leaves to root: eliminates one joint into the body of its parent.
template <class Scalar>
void eliminate(const Plan<Scalar>& plan, Workspace<Scalar>& ws, int i, const Scalar* q, const Scalar* qd,
               const Scalar* inputs) {
  const JointPlan<Scalar>& joint = plan.joints[i];
  JointState<Scalar>& s = ws.joints[i];
  const Scalar force = joint_force(plan, i, q[i], qd[i], inputs[i]);
  const InertiaColumn<Scalar> column = set_pivot(joint, s, force);
  if (joint.prescribed) prescribe(joint, s, inputs[i]);
  if (joint.parent == ground) return;
  JointState<Scalar>& parent = ws.joints[joint.parent];
  ArticulatedInertia<Scalar> A;
  Force<Scalar> p;
  reduce(joint, s, column, force, A, p);
  to_parent(joint, s, A);
  to_parent(joint, s, p);
  add(parent.A, A);
  add(parent.p, p);
}

// Root to leaves: acceleration of one joint. `from_loops`: contribution of the multipliers to u. `at_rest`:
// response to u alone, without gravity and velocity products.
template <class Scalar>
void accelerate_joint(const Plan<Scalar>& plan, Workspace<Scalar>& ws, int i, Scalar* qdd,
                      const Scalar& from_loops, bool at_rest = false) {
  const JointPlan<Scalar>& joint = plan.joints[i];
  JointState<Scalar>& s = ws.joints[i];
  Motion<Scalar> a;
  if (joint.parent != ground)
    a = ws.joints[joint.parent].acceleration;
  else
    a = {Vec3<Scalar>::Zero(), at_rest ? Vec3<Scalar>::Zero() : Vec3<Scalar>(-plan.gravity)};
  to_body(joint, s, a);
  if (!at_rest) {
    a.angular += s.c.angular;
    a.linear += s.c.linear;
  }
  qdd[i] = (s.u + from_loops - dot(s.U, a)) * s.D_inverse;
  add_motion(joint, qdd[i], a);
  s.acceleration = a;
  if (joint.prescribed) s.u = from_loops;
}

// Drive force of prescribed joint i (N m or N) after forward_dynamics at the same q, qd, qdd.
template <class Scalar>
Scalar prescribed_force(const Plan<Scalar>& plan, const Workspace<Scalar>& ws, int i, const Scalar* q,
                        const Scalar* qd, const Scalar* qdd) {
  const JointPlan<Scalar>& joint = plan.joints[i];
  const JointState<Scalar>& s = ws.joints[i];
  return dot(s.U, s.acceleration) + generalized_force(joint, s.p) - s.u + joint.armature * qdd[i] -
         joint_force(plan, i, q[i], qd[i], Scalar(0));
}

}  // namespace redysim
