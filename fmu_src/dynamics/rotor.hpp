#pragma once

#include "math/vec3.hpp"

// A rotor of axial inertia J on the parent link of a turning joint, about the joint axis z, with the speed N
// qd relative to the parent. Its energy J / 2 (omega_z + N qd)^2, with the parent's omega_z and the child's
// omega_z + qd, equals
//   J / 2 [(1 - N) omega_z^2 + N (omega_z + qd)^2 + N (N - 1) qd^2].
// So axial inertias of both links and an armature are the rotor exactly, its gyroscopic moment included.

namespace redysim {

struct RotorPlan {
  int joint = 0, parent = 0;                 // of the plan; parent: ground possible
  Vec3<double> axis = Vec3<double>::Zero();  // z in the body frame of the parent
  double inertia = 0, ratio = 1;             // J, N
};

// Moment of the axial inertia N J on the child, of angular velocity and acceleration in its axes. The rotor
// turns on the parent: the joint does not transmit it.
template <class Scalar>
Vec3<Scalar> moment_of_child(const RotorPlan& rotor, const Vec3<Scalar>& omega,
                             const Vec3<Scalar>& acceleration) {
  return Scalar(rotor.ratio * rotor.inertia) *
         Vec3<Scalar>(omega.y() * omega.z(), -omega.x() * omega.z(), acceleration.z());
}

}  // namespace redysim
