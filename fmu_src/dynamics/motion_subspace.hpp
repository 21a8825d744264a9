#pragma once

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"

// The motion subspace S = [angular e_z; linear e_z] of a joint, at the origin and in the axes of its body:
// the only property in which the joint types differ. The recursions access it through these functions only.

namespace redysim {

// Whether S has an angular or a linear part. The coordinate of a joint that turns is an angle.
template <class Scalar>
bool turns(const JointPlan<Scalar>& joint) {
  return joint.subspace != Subspace::translation;
}

template <class Scalar>
bool slides(const JointPlan<Scalar>& joint) {
  return joint.subspace != Subspace::rotation;
}

// The linear part of S: 0, 1 or the pitch (m/rad).
template <class Scalar>
double advance(const JointPlan<Scalar>& joint) {
  switch (joint.subspace) {
    case Subspace::rotation:
      return 0;
    case Subspace::translation:
      return 1;
    case Subspace::helix:
      break;
  }
  return joint.pitch;
}

// Rotation angle about z and offset along z at q.
template <class Scalar>
Scalar joint_angle(const JointPlan<Scalar>& joint, const Scalar& q) {
  return turns(joint) ? Scalar(joint.theta + q) : joint.theta;
}

template <class Scalar>
Scalar joint_offset(const JointPlan<Scalar>& joint, const Scalar& q) {
  switch (joint.subspace) {
    case Subspace::rotation:
      return joint.d;
    case Subspace::translation:
      return joint.d + q;
    case Subspace::helix:
      break;
  }
  return joint.d + joint.pitch * q;
}

// S^T w, the generalized force of a wrench.
template <class Scalar>
Scalar generalized_force(const JointPlan<Scalar>& joint, const Force<Scalar>& w) {
  switch (joint.subspace) {
    case Subspace::rotation:
      return w.moment.z();
    case Subspace::translation:
      return w.force.z();
    case Subspace::helix:
      break;
  }
  return w.moment.z() + joint.pitch * w.force.z();
}

// m += S rate.
template <class Scalar>
void add_motion(const JointPlan<Scalar>& joint, const Scalar& rate, Motion<Scalar>& m) {
  switch (joint.subspace) {
    case Subspace::rotation:
      m.angular.z() += rate;
      return;
    case Subspace::translation:
      m.linear.z() += rate;
      return;
    case Subspace::helix:
      m.angular.z() += rate;
      m.linear.z() += joint.pitch * rate;
      return;
  }
}

// The same with any axes; `along` is e_z times the rate.
template <class Scalar>
void add_motion(const JointPlan<Scalar>& joint, const Vec3<Scalar>& along, Vec3<Scalar>& angular,
                Vec3<Scalar>& linear) {
  switch (joint.subspace) {
    case Subspace::rotation:
      angular += along;
      return;
    case Subspace::translation:
      linear += along;
      return;
    case Subspace::helix:
      angular += along;
      linear += Scalar(joint.pitch) * along;
      return;
  }
}

// Adds the velocity products of qd and the angular velocity omega of the parent: gyroscopic angular and
// Coriolis linear acceleration. turned = omega x e_z qd.
template <class Scalar>
void add_velocity_product(const JointPlan<Scalar>& joint, const Vec3<Scalar>& turned, Motion<Scalar>& a) {
  switch (joint.subspace) {
    case Subspace::rotation:
      a.angular += turned;
      return;
    case Subspace::translation:
      a.linear += Scalar(2) * turned;
      return;
    case Subspace::helix:
      a.angular += turned;
      a.linear += Scalar(2 * joint.pitch) * turned;
      return;
  }
}

// The same with omega in body axes; sets the angular part of a, which has no other terms.
template <class Scalar>
void set_velocity_product(const JointPlan<Scalar>& joint, const Vec3<Scalar>& omega, const Scalar& qd,
                          Motion<Scalar>& a) {
  switch (joint.subspace) {
    case Subspace::rotation:
      a.angular = {qd * omega.y(), -qd * omega.x(), Scalar(0)};
      return;
    case Subspace::translation:
      a.linear.x() += Scalar(2) * qd * omega.y();
      a.linear.y() -= Scalar(2) * qd * omega.x();
      a.angular.setZero();
      return;
    case Subspace::helix:
      a.angular = {qd * omega.y(), -qd * omega.x(), Scalar(0)};
      a.linear += Scalar(2 * joint.pitch) * a.angular;
      return;
  }
}

// A S of an articulated inertia: the lanes of each row are moment, force, force, moment.
template <class Scalar>
struct InertiaColumn {
  Lanes<Scalar> x, y, z;
};

template <class Scalar>
REDYSIM_INLINE InertiaColumn<Scalar> inertia_column(const JointPlan<Scalar>& joint,
                                                    const ArticulatedInertia<Scalar>& A) {
  switch (joint.subspace) {
    case Subspace::rotation:
      return {permuted<0, 3, 3, 0>(A.xz), permuted<0, 3, 3, 0>(A.yz), permuted<0, 3, 3, 0>(A.zz)};
    case Subspace::translation:
      return {permuted<2, 1, 1, 2>(A.xz), permuted<2, 1, 1, 2>(A.yz), permuted<2, 1, 1, 2>(A.zz)};
    case Subspace::helix:
      break;
  }
  const auto column = [&joint](const Lanes<Scalar>& entry) {
    return permuted<0, 3, 3, 0>(entry) + Scalar(joint.pitch) * permuted<2, 1, 1, 2>(entry);
  };
  return {column(A.xz), column(A.yz), column(A.zz)};
}

// S^T A S from entry zz of A.
template <class Scalar>
Scalar axis_inertia(const JointPlan<Scalar>& joint, const Lanes<Scalar>& zz) {
  switch (joint.subspace) {
    case Subspace::rotation:
      return zz[0];
    case Subspace::translation:
      return zz[1];
    case Subspace::helix:
      break;
  }
  return zz[0] + joint.pitch * (zz[2] + zz[3] + joint.pitch * zz[1]);
}

// Squared upper bound of S^T w from the squared norms of moment and force (or other squared measures of the
// angular and the linear part).
template <class Scalar>
Scalar largest_squared(const JointPlan<Scalar>& joint, const Scalar& moment, const Scalar& force) {
  switch (joint.subspace) {
    case Subspace::rotation:
      return moment;
    case Subspace::translation:
      return force;
    case Subspace::helix:
      break;
  }
  return moment + joint.pitch * joint.pitch * force;
}

}  // namespace redysim
