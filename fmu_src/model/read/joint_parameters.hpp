#pragma once

#include <vector>

#include "model/model.hpp"
#include "model/read/section.hpp"

namespace redysim {

// A numeric field of a joint with one DOF.
struct JointParameter {
  // Positions and velocities of rotating joints are in the angle unit of the file.
  enum class Kind { position, velocity, other };
  const char* name;
  double Joint::*value;
  Kind kind = Kind::other;
  Bound bound = Bound::any;
  bool tunable = true;
};

inline constexpr JointParameter joint_parameters[] = {
    {"q", &Joint::q0, JointParameter::Kind::position, Bound::any, false},
    {"qd", &Joint::qd0, JointParameter::Kind::velocity, Bound::any, false},
    {"damping", &Joint::damping, JointParameter::Kind::other, Bound::not_negative},
    {"stiffness", &Joint::stiffness, JointParameter::Kind::other, Bound::not_negative},
    {"rest", &Joint::rest, JointParameter::Kind::position},
    {"armature", &Joint::armature, JointParameter::Kind::other, Bound::not_negative},
    {"friction", &Joint::friction, JointParameter::Kind::other, Bound::not_negative},
    {"static_friction", &Joint::static_friction, JointParameter::Kind::other, Bound::not_negative},
    {"friction_velocity", &Joint::friction_velocity, JointParameter::Kind::velocity, Bound::positive},
    {"lower", &Joint::lower, JointParameter::Kind::position},
    {"upper", &Joint::upper, JointParameter::Kind::position},
    {"stop_stiffness", &Joint::stop_stiffness, JointParameter::Kind::other, Bound::not_negative},
    {"stop_damping", &Joint::stop_damping, JointParameter::Kind::other, Bound::not_negative},
    {"stop_width", &Joint::stop_width, JointParameter::Kind::position, Bound::positive},
};

// Reads and checks the parameters of a joint with one DOF; type and drive must be set. `degrees`: angles are
// in degrees.
void read_joint_parameters(Section& section, Joint& joint, bool degrees);

// The same for several DOF: each field is a list with one number per DOF, and stops may be infinite.
void read_joint_parameters(Section& section, std::vector<Joint>& dofs, bool degrees);

}  // namespace redysim
