#pragma once

#include <limits>

namespace redysim {

// The drive train between an input and a joint: lag, limits, motor and gear. Torques, stiffness, backlash and
// limits refer to the joint side (for a prismatic joint they are forces and lengths); rotor inertia and
// torque constant refer to the motor side. Equations: integrate/actuator/actuator_law.hpp, docs/actuators.md.
template <class Scalar>
struct ActuatorOf {
  int link = 0;                              // the actuator drives the joint of this link
  double gear_ratio = 1, rotor_inertia = 0;  // motor angle divided by q; kg m^2
  bool gyroscopic = false;                   // the rotor turns with the parent link (dynamics/rotor.hpp)
  // the values that a master may set
  Scalar stiffness = 0, damping = 0;  // of an elastic gear; stiffness 0: rigid gear
  Scalar backlash = 0,
         backlash_width = 0;  // total play; depth beyond it at which the gear reaches full stiffness
  Scalar torque_limit = std::numeric_limits<double>::infinity(), torque_limit_width = 0;
  Scalar speed_limit = std::numeric_limits<double>::infinity(), speed_limit_width = 0;
  Scalar time_constant = 0;  // of the lag of the input, s
  // DC motor: ohm, H, N m/A = V s/rad; resistance 0: no motor, the input is a torque
  Scalar resistance = 0, inductance = 0, torque_constant = 0;

  bool is_elastic() const { return stiffness > 0; }
  bool is_electric() const { return resistance > 0; }
  bool has_backlash() const { return backlash > 0; }
  bool has_inductance() const { return inductance > 0; }
  bool limits_torque() const { return torque_limit < std::numeric_limits<double>::infinity(); }
  bool limits_speed() const { return speed_limit < std::numeric_limits<double>::infinity(); }
  bool has_limits() const { return limits_torque() || limits_speed(); }
  bool lags() const { return time_constant > 0; }
  // If false, the input is the torque on the joint, and the joint's armature contains the rotor inertia.
  bool acts() const { return is_elastic() || is_electric() || has_limits() || lags(); }

  template <class Other>
  ActuatorOf<Other> cast() const {
    return {link,          gear_ratio,     rotor_inertia, gyroscopic,         stiffness,   damping,
            backlash,      backlash_width, torque_limit,  torque_limit_width, speed_limit, speed_limit_width,
            time_constant, resistance,     inductance,    torque_constant};
  }
};
using Actuator = ActuatorOf<double>;

}  // namespace redysim
