#include <algorithm>
#include <cmath>

#include "dynamics/compiled.hpp"
#include "integrate/system/system.hpp"

// Prescribed motion between the steps of a System, and its jumps.

namespace redysim {
void System::set_motion(double time, int joint, double q, double qd, double qdd) {
  if (motion_slot_[joint] < 0) return;  // a trajectory prescribes it
  double* held = held_motion(motion_slot_[joint]);
  held[InputLayout::held_time] = time;
  held[InputLayout::held_q] = q;
  held[InputLayout::held_qd] = qd;
  tau(joint) = qdd;
}

void System::change_motion(double time, int joint, int derivative, double value) {
  hold_motion(time, joint);
  if (derivative == 2) {
    tau(joint) = value;
    return;
  }
  double* held = held_motion(motion_slot_[joint]);
  held[InputLayout::held_q_jump + derivative] += value - held[InputLayout::held_q + derivative];
  held[InputLayout::held_q + derivative] = value;
}

bool System::jumped() const {
  for (int joint = 0; joint < plan_.nv; ++joint)
    if (jump(joint, 0) != 0 || jump(joint, 1) != 0) return true;
  return false;
}

void System::forget_jumps() {
  for (int slot = 0; slot < input_layout_.held_motion.count; ++slot)
    held_motion(slot)[InputLayout::held_q_jump] = held_motion(slot)[InputLayout::held_qd_jump] = 0;
}

bool System::follow_jumps(double time, double* y) {
  if (!plan_.has_motion()) return true;
  const bool jumps = jumped();
  const double before = jumps && with_work() ? energy_before_jumps(time, y) : 0;
  std::copy(y, y + size(), unmoved_.begin());
  if (jumps) {
    respond(time, y, false);
    respond(time, y, true);
  }
  // a projection uses the elimination at the previous state, which is far away after a jump
  const bool closed = close_loops(time, y) && (!jumps || close_loops(time, y));
  if (jumps && with_work())
    *layout_.work.of(y) += kinetic_energy(time, y) + potential_energy(time, y) - before;
  if (closed && std::all_of(y, y + size(), [](double value) { return std::isfinite(value); })) return true;
  std::copy(unmoved_.begin(), unmoved_.end(), y);
  return false;
}

double System::energy_before_jumps(double time, const double* y) {
  const Coordinates at = coordinates(time, y);
  for (int i = 0; i < plan_.nv; ++i) {
    if (motion_slot_[i] < 0) continue;
    q_[i] -= jump(i, 0);
    qd_[i] -= jump(i, 1);
  }
  return energy(at.q, at.qd, y);
}

// Jump of the other joints due to a jump of the prescribed ones. Accelerations are linear in the prescribed
// ones, with the factor -M_ff^-1 M_fp. The difference of two forward dynamics, the second with the jump added
// to the prescribed accelerations, is the jump of the other joints. Both are without inputs, which cancel out
// up to rounding.
void System::respond(double time, double* y, bool velocity) {
  std::vector<double>& inputs = scratch_inputs_;
  std::fill(inputs.begin(), inputs.end(), 0.0);
  const Coordinates at = coordinates(time, y);
  compiled_forward_dynamics(plan_, workspace_, at.q, at.qd, inputs.data(), scratch_.data());
  for (int i = 0; i < plan_.nv; ++i)
    if (motion_slot_[i] >= 0) inputs[input_layout_.tau[i]] = jump(i, velocity);
  compiled_forward_dynamics(plan_, workspace_, at.q, at.qd, inputs.data(), drive_.data());
  for (int i = 0; i < plan_.nv; ++i) drive_[i] -= scratch_[i];
  add_change(drive_.data(), y, velocity);
}

}  // namespace redysim
