#pragma once

#include "math/vec3.hpp"

// A rotor with axial inertia J on the parent link of a rotational joint, about the joint axis z, with speed N
// qd relative to the parent. With omega_z of the parent and omega_z + qd of the child, its energy J / 2
// (omega_z + N qd)^2 equals
//   J / 2 [(1 - N) omega_z^2 + N (omega_z + qd)^2 + N (N - 1) qd^2].
// The rotor is therefore represented exactly by axial inertias of both links and an armature, including its
// gyroscopic moment.

namespace redysim {

struct RotorPlan {
  int joint = 0, parent = 0;                 // indices into the plan; parent may be ground
  Vec3<double> axis = Vec3<double>::Zero();  // z in the body frame of the parent
  double inertia = 0, ratio = 1;             // J, N
};

// Moment of the axial inertia N J on the child; angular velocity and acceleration in the child's axes. The
// joint does not transmit this moment, since the rotor rotates on the parent.
template <class Scalar>
Vec3<Scalar> moment_of_child(const RotorPlan& rotor, const Vec3<Scalar>& omega,
                             const Vec3<Scalar>& acceleration) {
  return Scalar(rotor.ratio * rotor.inertia) *
         Vec3<Scalar>(omega.y() * omega.z(), -omega.x() * omega.z(), acceleration.z());
}

}  // namespace redysim
