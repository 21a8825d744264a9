#include <cmath>

#include "fmi/boundary/arrays.hpp"
#include "fmi/instance/instance.hpp"
#include "model/read/number.hpp"

// Derivatives of inputs by time.

namespace redysim {
namespace {

// How often a part of a prescribed motion is derived by itself; the derivatives of the three are one chain.
int motion_order(Role role) {
  return role == Role::motion_q ? 0 : role == Role::motion_qd ? 1 : role == Role::motion_qdd ? 2 : -1;
}

}  // namespace

fmi2Status Instance::set_real_input_derivatives(const unsigned* references, std::size_t count,
                                                const int* orders, const double* values) {
  constexpr Function function = Function::set_real_input_derivatives;
  if (const char* why = objection_to_arrays(count, {references, orders, values}))
    return refuse(function, why);
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = table_.real(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], "Real"));
    if (variable->causality != Causality::input)
      return refuse(function, variable->name + " is not an input: its derivatives cannot be set");
    if (orders[i] < 1 || orders[i] > InputLayout::highest_order)
      return refuse(function, variable->name + ": the order must be 1 to " +
                                  std::to_string(InputLayout::highest_order) + ", got " +
                                  std::to_string(orders[i]));
    if (!std::isfinite(values[i]))
      return refuse(function, "a derivative of " + variable->name + " must be a finite number, got " +
                                  shown(values[i]));
  }
  for (std::size_t i = 0; i < count; ++i)
    set_input_derivative(*table_.real(references[i]), orders[i], values[i]);
  return fmi2OK;
}

// q' of a prescribed joint is qd and q'' is qdd: what is set last holds.
void Instance::set_input_derivative(const Variable& variable, int order, double value) {
  const int of_motion = motion_order(variable.role);
  if (of_motion >= 0 && of_motion + order <= 2) {
    Variable part = variable;
    part.role = of_motion + order == 1 ? Role::motion_qd : Role::motion_qdd;
    set_motion(part, value);
    return;
  }
  const int slope = of_motion >= 0 ? of_motion + order - 2 : order;
  const int input = of_motion >= 0 ? variable.joint : force_index(variable);
  if (value == 0 && !system_.has_input_slopes()) return;
  system_.set_input_slope(time_, input, slope, value);
}

// An input that moved stays where it is, which is then its value as last set.
void Instance::end_input_slopes(double time) {
  if (!system_.has_input_slopes()) return;
  system_.end_input_slopes(time);
  for (int i = 0; i < plan_.nv; ++i)
    if (plan_.joints[i].prescribed) motion_[3 * i + 2] = system_.inputs()[i];
}

}  // namespace redysim
