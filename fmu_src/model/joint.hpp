#pragma once

#include <limits>
#include <string>
#include <utility>

namespace redysim {

// The kinds of joints in a Model. The reader builds joints of several degrees of freedom from them
// (model/read/compound_joint.hpp).
enum class JointType { revolute, prismatic, screw, fixed };

// Names of the types in model files and in drawings.
inline constexpr std::pair<const char*, JointType> joint_types[] = {{"revolute", JointType::revolute},
                                                                    {"prismatic", JointType::prismatic},
                                                                    {"screw", JointType::screw},
                                                                    {"fixed", JointType::fixed}};

// Actuation of a joint: a torque input, a prescribed motion (inverse dynamics of that joint), locked at its
// start position, or free (no actuation).
enum class Drive { torque, motion, locked, free };

// Modified DH after Khalil and Kleinfinger (1986); parent frame to link frame:
//   T = Rz(gamma) Tz(b) Rx(alpha) Tx(a) Rz(theta) Tz(d)      angles in rad, lengths in m
struct DhParameters {
  double gamma = 0, b = 0, alpha = 0, a = 0, theta = 0, d = 0;
};

// The parameters of a joint that a master may set. tau_passive = -stiffness (q - rest) - damping qd -
// friction and stop forces (dynamics/joint_force.hpp). armature is added to the diagonal of the mass matrix.
template <class Scalar>
struct JointParameters {
  Scalar q0 = 0, qd0 = 0;
  Scalar damping = 0, stiffness = 0, rest = 0, armature = 0;
  // N m or N; static_friction: maximum, at friction_velocity (rad/s or m/s); no peak if it is below friction
  Scalar friction = 0, static_friction = 0, friction_velocity = 0.01;
  // stops at lower and upper; damping in s/rad or s/m; full stiffness is reached at the depth stop_width
  Scalar lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
  Scalar stop_stiffness = 0, stop_damping = 0, stop_width = 0.01;

  template <class Other>
  JointParameters<Other> cast() const {
    const auto to = [](const auto&... numbers) { return JointParameters<Other>{numbers...}; };
    return to(q0, qd0, damping, stiffness, rest, armature, friction, static_friction, friction_velocity,
              lower, upper, stop_stiffness, stop_damping, stop_width);
  }
};

// The joint between a link and its parent; its axis is the z axis of the link frame.
struct Joint : JointParameters<double> {
  std::string name;
  JointType type = JointType::revolute;
  Drive drive = Drive::torque;
  DhParameters dh;
  double pitch = 0;   // of a screw joint, m/rad
  bool hold = false;  // loop assembly does not change q0
  // part of a compound joint: axis k of the model file is axis (k + turned) % 3 of the link frame
  unsigned char turned = 0;
};

// S = [angular e_z; linear e_z] in link axes: the twist of the link relative to its parent is S qd. A
// displacement q adds angular q to theta and linear q to d. `angular` is 1 or 0; if it is 0, `linear` is 1.
struct MotionSubspace {
  double angular, linear;
};

inline MotionSubspace motion_subspace(const Joint& joint) {
  switch (joint.type) {
    case JointType::revolute:
      return {1, 0};
    case JointType::prismatic:
      return {0, 1};
    case JointType::screw:
      return {1, joint.pitch};
    case JointType::fixed:
      break;
  }
  return {0, 0};
}

inline bool moves(const Joint& joint) { return joint.type != JointType::fixed; }
inline bool is_prescribed(const Joint& joint) {
  return joint.drive == Drive::motion || joint.drive == Drive::locked;
}

// Whether the coordinate is an angle (rad, with N m); otherwise it is a displacement (m, with N).
inline bool turns(const Joint& joint) { return motion_subspace(joint).angular != 0; }
inline bool slides(const Joint& joint) { return motion_subspace(joint).linear != 0; }

inline DhParameters displaced(const Joint& joint, double q) {
  DhParameters dh = joint.dh;
  dh.theta += motion_subspace(joint).angular * q;
  dh.d += motion_subspace(joint).linear * q;
  return dh;
}

template <class Scalar>
bool has_stops(const JointParameters<Scalar>& joint) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  return joint.lower > -infinity || joint.upper < infinity;
}

}  // namespace redysim
