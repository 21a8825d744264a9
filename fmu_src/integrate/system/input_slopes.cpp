#include <algorithm>

#include "integrate/system/system.hpp"

// Inputs that move as polynomials of time: u(t) = u + u' s + u'' s^2 / 2 + u''' s^3 / 6 with s = t - anchor.
// They lie behind the held inputs, [anchor; u' of all; u'' of all; u''' of all], and only while they are
// used.

namespace redysim {
namespace {

constexpr int orders = System::highest_input_order;

// Taylor's sum of `count` derivatives, `stride` apart, without the value itself: the k-th over (k + shift)!.
double taylor(const double* slopes, std::size_t stride, double since, int shift) {
  double sum = 0;
  for (int k = orders; k > 0; --k) sum = (sum + slopes[(k - 1) * stride]) * since / (k + shift);
  for (int k = shift; k > 0; --k) sum *= since / k;
  return sum;
}

}  // namespace

bool System::is_input_size(std::size_t size) const {
  return size == base_size_ || size == base_size_ + 1 + orders * forces_size();
}

void System::resize_inputs(std::size_t size) {
  inputs_.resize(size, 0.0);
  if (!has_input_slopes()) return;
  applied_.resize(forces_size(), 0.0);
  if (plan_.has_motion()) scratch_inputs_.reserve(size);
}

void System::swap_inputs(std::vector<double>& other) {
  inputs_.swap(other);
  resize_inputs(inputs_.size());
}

void System::set_input_slope(double time, int input, int order, double value) {
  if (!has_input_slopes()) {
    resize_inputs(base_size_ + 1 + orders * forces_size());
    inputs_[base_size_] = time;
  }
  if (input < plan_.nv && motion_slot_[input] >= 0) hold_motion(time, input);
  inputs_[base_size_ + 1 + (order - 1) * forces_size() + input] = value;
}

double System::input_slope(int input) const {
  return has_input_slopes() ? inputs_[base_size_ + 1 + input] : 0;
}

void System::anchor_input_slopes(double time) {
  if (has_input_slopes()) inputs_[base_size_] = time;
}

void System::end_input_slopes(double time) {
  if (!has_input_slopes()) return;
  for (int i = 0; i < plan_.nv; ++i)
    if (motion_slot_[i] >= 0) hold_motion(time, i);
  take_inputs(time);  // slopes have brought `applied_` along
  std::copy(applied_.begin(), applied_.end(), inputs_.begin());
  resize_inputs(base_size_);
}

// The forces of now into `applied_`, where they are not simply `inputs_`.
void System::take_inputs(double time) {
  std::copy_n(inputs_.begin(), forces_size(), applied_.begin());
  if (!has_input_slopes()) return;
  const double since = time - inputs_[base_size_];
  for (std::size_t i = 0; i < forces_size(); ++i)
    applied_[i] += taylor(&inputs_[base_size_ + 1 + i], forces_size(), since, 0);
}

// A prescribed joint's q (derivative 0), qd (1) or qdd (2) at `time`.
double System::motion_at(double time, int joint, int derivative) const {
  const double* held = &inputs_[held_begin() + held_size * motion_slot_[joint]];
  const double since = time - held[0];
  double value = derivative == 0   ? held[1] + since * (held[2] + 0.5 * since * inputs_[joint])
                 : derivative == 1 ? held[2] + since * inputs_[joint]
                                   : inputs_[joint];
  if (has_input_slopes())
    value += taylor(&inputs_[base_size_ + 1 + joint], forces_size(), since, 2 - derivative);
  return value;
}

// The same motion, told from `time` on; a joint's jump since the last step stays as it is.
void System::hold_motion(double time, int joint) {
  double* held = held_motion(motion_slot_[joint]);
  const double q = motion_at(time, joint, 0), qd = motion_at(time, joint, 1);
  held[0] = time;
  held[1] = q;
  held[2] = qd;
}

}  // namespace redysim
