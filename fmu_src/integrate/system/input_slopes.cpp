#include <algorithm>

#include "integrate/system/system.hpp"

// Inputs as polynomials of time: u(t) = u + u' s + u'' s^2 / 2 + u''' s^3 / 6 with s = t - slope_time. Their
// derivatives are stored after the held inputs (InputLayout), only while they are used.

namespace redysim {
namespace {

constexpr int orders = InputLayout::highest_order;

// Taylor sum of `count` derivatives, `stride` apart, without the value: derivative k / (k + shift)!.
double taylor(const double* slopes, int count, int stride, double since, int shift) {
  double sum = 0;
  for (int k = count; k > 0; --k) sum = (sum + slopes[(k - 1) * stride]) * since / (k + shift);
  for (int k = shift; k > 0; --k) sum *= since / k;
  return sum;
}

}  // namespace

bool System::is_input_size(std::size_t size) const {
  return size == base_size() || size == static_cast<std::size_t>(input_layout_.size_with_slopes());
}

void System::resize_inputs(std::size_t size) {
  inputs_.resize(size);
  if (!has_input_slopes()) return;
  recursion_inputs_.resize(static_cast<std::size_t>(input_layout_.force_size()));
}

void System::swap_inputs(std::vector<double>& other) {
  inputs_.swap(other);
  resize_inputs(inputs_.size());
}

void System::set_input_slope(double time, int input, int order, double value) {
  if (!has_input_slopes()) {
    const bool read_from_inputs = recursion_inputs_.empty();
    resize_inputs(static_cast<std::size_t>(input_layout_.size_with_slopes()));
    inputs_[input_layout_.slope_time()] = time;
    // values that were read at this time remain current, forces of controllers and actuators too
    if (read_from_inputs) update_recursion_inputs(time);
  }
  if (input < plan_.nv && motion_slot_[input] >= 0) hold_motion(time, input);
  inputs_[input_layout_.slope(order, input)] = value;
}

double System::input_slope(int input) const {
  return has_input_slopes() ? inputs_[input_layout_.slope(1, input)] : 0;
}

double System::input_derivative(double time, int input, int order) const {
  if (!has_input_slopes()) return order == 0 ? inputs_[input] : 0.0;
  const double value = order == 0 ? inputs_[input] : inputs_[input_layout_.slope(order, input)];
  return value + taylor(inputs_.data() + input_layout_.slope(order + 1, input), orders - order,
                        input_layout_.force_size(), time - inputs_[input_layout_.slope_time()], 0);
}

void System::anchor_input_slopes(double time) {
  if (has_input_slopes()) inputs_[input_layout_.slope_time()] = time;
}

void System::end_input_slopes(double time) {
  if (!has_input_slopes()) return;
  for (int i = 0; i < plan_.nv; ++i)
    if (motion_slot_[i] >= 0) hold_motion(time, i);
  update_recursion_inputs(time);  // recursion_inputs_ was allocated together with the slopes
  std::copy(recursion_inputs_.begin(), recursion_inputs_.end(), inputs_.begin());
  resize_inputs(base_size());
}

// Sets `recursion_inputs_` to the forces at `time`.
void System::update_recursion_inputs(double time) {
  std::copy_n(inputs_.begin(), input_layout_.force_size(), recursion_inputs_.begin());
  if (!has_input_slopes()) return;
  const double since = time - inputs_[input_layout_.slope_time()];
  const int count = input_layout_.force_size();
  for (int i = 0; i < count; ++i)
    recursion_inputs_[i] += taylor(&inputs_[input_layout_.slope(1, i)], orders, count, since, 0);
}

// A prescribed joint's q (derivative 0), qd (1) or qdd (2) at `time`.
double System::motion_at(double time, int joint, int derivative) const {
  const double* held = &inputs_[input_layout_.held_motion[motion_slot_[joint]]];
  const double since = time - held[InputLayout::held_time], q = held[InputLayout::held_q],
               qd = held[InputLayout::held_qd], qdd = inputs_[input_layout_.tau[joint]];
  double value = derivative == 0   ? q + since * (qd + 0.5 * since * qdd)
                 : derivative == 1 ? qd + since * qdd
                                   : qdd;
  if (has_input_slopes())
    value += taylor(&inputs_[input_layout_.slope(1, joint)], orders, input_layout_.force_size(), since,
                    2 - derivative);
  return value;
}

// Continues the same motion with `time` as its start; keeps a pending jump.
void System::hold_motion(double time, int joint) {
  set_motion(time, joint, motion_at(time, joint, 0), motion_at(time, joint, 1), tau(joint));
}

}  // namespace redysim
