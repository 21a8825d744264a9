#pragma once

#include "dynamics/plan.hpp"

namespace redysim {

// Indices of consecutive entries of `Width` numbers each in an array, starting at `begin`.
template <int Width>
struct Span {
  int begin = 0, count = 0;

  int operator[](int entry) const { return begin + Width * entry; }
  int size() const { return Width * count; }
  int end() const { return begin + size(); }
  bool contains(int index) const { return begin <= index && index < end(); }
  int entry_at(int index) const { return (index - begin) / Width; }

  template <class Number>
  Number* of(Number* array, int entry = 0) const {
    return array + begin + Width * entry;
  }
};

// Indices of the inputs of a right-hand side. forward_dynamics uses only the first recursion_size() numbers.
struct InputLayout {
  Span<1> tau;          // per joint: drive torque or force, N m or N; for a prescribed joint its qdd
  Span<6> port_wrench;  // per port: moment and force, N m and N
  Span<3> ball_torque;  // per spherical joint, N m, link axes
  Span<5> held_motion;  // per prescribed joint without a trajectory: Held
  Span<1> phase;        // per trajectory, then the memory of a sampled controller

  // Entries of a held motion: time, q and qd at this time, and pending jumps since the last step.
  enum Held { held_time, held_q, held_qd, held_q_jump, held_qd_jump };

  InputLayout() = default;
  template <class Scalar>
  explicit InputLayout(const Plan<Scalar>& plan, int held_motions = 0, int phases = 0)
      : tau{0, plan.nv},
        port_wrench{tau.end(), static_cast<int>(plan.ports.size())},
        ball_torque{port_wrench.end(), static_cast<int>(plan.balls.size())},
        held_motion{ball_torque.end(), held_motions},
        phase{held_motion.end(), phases} {}

  int recursion_size() const { return port_wrench.end(); }
  int force_size() const { return ball_torque.end(); }  // inputs that may have time derivatives
  int size() const { return phase.end(); }

  // While time derivatives of the forces are used, they follow all other inputs: their start time, then the
  // first, second and third derivatives of all forces.
  static constexpr int highest_order = 3;
  int slope_time() const { return size(); }
  int slope(int order, int force) const { return size() + 1 + (order - 1) * force_size() + force; }
  int size_with_slopes() const { return slope(highest_order + 1, 0); }
};

}  // namespace redysim
