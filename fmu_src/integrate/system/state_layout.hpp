#pragma once

#include "dynamics/input_layout.hpp"

namespace redysim {

// Numbers of actuator states by kind.
struct ActuatorCounts {
  int motors = 0, currents = 0, lags = 0;
};

// Positions of the parts of the state y = [q; quaternion; qd; omega; actuators; work]. `q` and `qd` belong to
// the integrated joints with one degree of freedom.
struct StateLayout {
  Span<1> q;           // rad or m
  Span<4> quaternion;  // per spherical joint: w, x, y, z
  Span<1> qd;          // rad/s or m/s
  Span<3> omega;       // per spherical joint: rad/s, link axes
  Span<1> motor_q;     // per elastic gear: angle of its motor, rad
  Span<1> motor_qd;    // rad/s
  Span<1> current;     // per DC motor with inductance, A
  Span<1> lagged;      // per lag: the input behind it, N m, N or V
  Span<1> work;        // J, if requested; the second one is that of contacts, if there are any

  StateLayout() = default;
  StateLayout(int joints, int balls, int works, const ActuatorCounts& actuators = {})
      : q{0, joints},
        quaternion{q.end(), balls},
        qd{quaternion.end(), joints},
        omega{qd.end(), balls},
        motor_q{omega.end(), actuators.motors},
        motor_qd{motor_q.end(), actuators.motors},
        current{motor_qd.end(), actuators.currents},
        lagged{current.end(), actuators.lags},
        work{lagged.end(), works} {}

  int nq() const { return qd.begin; }                           // positions
  int nv() const { return omega.end() - qd.begin; }             // velocities
  int actuators() const { return work.begin - motor_q.begin; }  // number of actuator states
  int size() const { return work.end(); }
};

}  // namespace redysim
