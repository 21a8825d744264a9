#pragma once

#include "dynamics/input_layout.hpp"

namespace redysim {

// Positions of the parts of the state y = [q; quaternion; qd; omega; work]. `q` and `qd` belong to the
// integrated joints with one degree of freedom.
struct StateLayout {
  Span<1> q;           // rad or m
  Span<4> quaternion;  // per spherical joint: w, x, y, z
  Span<1> qd;          // rad/s or m/s
  Span<3> omega;       // per spherical joint: rad/s, link axes
  Span<1> work;        // J, when asked for; then that of contacts alone, where there are any

  StateLayout() = default;
  StateLayout(int joints, int balls, int works)
      : q{0, joints},
        quaternion{q.end(), balls},
        qd{quaternion.end(), joints},
        omega{qd.end(), balls},
        work{omega.end(), works} {}

  int nq() const { return qd.begin; }                // positions
  int nv() const { return omega.end() - qd.begin; }  // velocities
  int size() const { return work.end(); }
};

}  // namespace redysim
