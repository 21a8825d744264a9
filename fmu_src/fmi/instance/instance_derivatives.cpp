#include <cmath>
#include <numeric>

#include "fmi/boundary/arrays.hpp"
#include "fmi/instance/instance.hpp"
#include "fmi/variables/parameters.hpp"
#include "model/number.hpp"

// Time derivatives of inputs, set by the master, and derivatives of outputs, read by it.

namespace redysim {

fmi2Status Instance::set_real_input_derivatives(const unsigned* references, std::size_t count,
                                                const int* orders, const double* values) {
  constexpr Function function = Function::set_real_input_derivatives;
  if (const char* why = objection_to_arrays(count, {references, orders, values}))
    return refuse(function, why);
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = simulation_.table.real(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], VariableType::real));
    if (variable->causality() != Causality::input)
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
    set_input_derivative(*simulation_.table.real(references[i]), orders[i], values[i]);
  return fmi2OK;
}

// The inputs of a prescribed motion are linked by q' = qd and q'' = qdd: the value set last applies.
void Instance::set_input_derivative(const Variable& variable, int order, double value) {
  System& system = simulation_.system;
  const int motion = variable.is_motion() ? variable.row->motion_order : -1;
  if (motion >= 0 && motion + order <= 2) {
    set_motion(variable.joint, motion + order, value);
    return;
  }
  const int slope = motion >= 0 ? motion + order - 2 : order;
  const int input =
      motion >= 0 ? variable.joint : variable.group->input(variable.row_index(), system, variable);
  if (value == 0 && !system.has_input_slopes()) return;
  system.set_input_slope(simulation_.time, input, slope, value);
}

fmi2Status Instance::get_directional_derivative(const unsigned* unknowns, std::size_t unknown_count,
                                                const unsigned* knowns, std::size_t known_count,
                                                const double* directions, double* derivatives) {
  return directional_derivative(Function::get_directional_derivative, unknowns, unknown_count, knowns,
                                known_count, directions, derivatives);
}

// By one reverse sweep if possible, otherwise by one forward pass per known.
fmi2Status Instance::get_adjoint_derivative(const unsigned* unknowns, std::size_t unknown_count,
                                            const unsigned* knowns, std::size_t known_count,
                                            const double* seed, double* sensitivity) {
  constexpr Function function = Function::get_adjoint_derivative;
  const char* objection = objection_to_arrays(unknown_count, {unknowns, seed});
  if (!objection) objection = objection_to_arrays(known_count, {knowns, sensitivity});
  if (objection) return refuse(function, objection);
  for (std::size_t i = 0; i < unknown_count; ++i)
    if (!std::isfinite(seed[i]))
      return refuse(function, "a seed must be a finite number, got " + shown(seed[i]));
  if (life_.state != State::initialization &&
      derivatives_.pull_back(unknowns, unknown_count, knowns, known_count, seed, sensitivity)) {
    warn_of_singular_loops(function);
    return fmi2OK;
  }
  std::vector<double> column(unknown_count);
  for (std::size_t k = 0; k < known_count; ++k) {
    const double one = 1;
    const fmi2Status status =
        directional_derivative(function, unknowns, unknown_count, knowns + k, 1, &one, column.data());
    if (status != fmi2OK) return status;
    sensitivity[k] = std::inner_product(column.begin(), column.end(), seed, 0.0);
  }
  return fmi2OK;
}

fmi2Status Instance::directional_derivative(Function function, const unsigned* unknowns,
                                            std::size_t unknown_count, const unsigned* knowns,
                                            std::size_t known_count, const double* directions,
                                            double* derivatives) {
  const char* objection = objection_to_arrays(unknown_count, {unknowns, derivatives});
  if (!objection) objection = objection_to_arrays(known_count, {knowns, directions});
  if (objection) return refuse(function, objection);
  const bool in_initialization = life_.state == State::initialization;
  if (in_initialization && simulation_.model.starts_in_equilibrium)
    return refuse(function,
                  "derivatives of a start in equilibrium are not available; they exist after initialization");
  for (std::size_t i = 0; i < known_count; ++i) {
    const Variable* variable = simulation_.table.real(knowns[i]);
    if (!variable) return refuse(function, unknown_reference(knowns[i], VariableType::real));
    const std::string why = derivatives_.objection(*variable, directions[i], in_initialization);
    if (!why.empty()) return refuse(function, why);
  }
  std::string why = derivatives_.begin();
  if (!why.empty()) return refuse(function, why);
  for (std::size_t i = 0; i < known_count; ++i)
    derivatives_.set_direction(*simulation_.table.real(knowns[i]), directions[i]);
  why = derivatives_.follow(in_initialization);
  if (!why.empty()) return refuse(function, why);
  return read_derivatives(function, unknowns, unknown_count, derivatives);
}

fmi2Status Instance::get_real_output_derivatives(const unsigned* references, std::size_t count,
                                                 const int* orders, double* values) {
  constexpr Function function = Function::get_real_output_derivatives;
  if (const char* why = objection_to_arrays(count, {references, orders, values}))
    return refuse(function, why);
  bool all_known = true;  // the derivatives are values of other outputs: no dual numbers are needed
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = simulation_.table.real(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], VariableType::real));
    if (variable->causality() != Causality::output || variable->variability() != Variability::continuous)
      return refuse(function, variable->name + " is not a continuous output: it has no derivatives");
    if (orders[i] != 1)
      return refuse(function, variable->name + ": the order must be 1, got " + std::to_string(orders[i]));
    all_known = all_known && variable->row->rate_is_next;
  }
  if (!all_known) {
    const std::string why = derivatives_.go_with_time();
    if (!why.empty()) return refuse(function, why);
    return read_derivatives(function, references, count, values);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Variable& variable = *simulation_.table.real(references[i]);
    const std::string why = values_.update(variable.row[1].needs);
    if (!why.empty()) return refuse(function, why);
    values[i] = values_.read_rate(variable);
  }
  return fmi2OK;
}

fmi2Status Instance::read_derivatives(Function function, const unsigned* references, std::size_t count,
                                      double* derivatives) {
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = simulation_.table.real(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], VariableType::real));
    if (!variable->is_calculated() || variable->row->is_indicator)
      return refuse(function, variable->name + " is not an output: it has no derivatives");
  }
  const std::string why = derivatives_.evaluate();
  if (!why.empty()) return refuse(function, why);
  for (std::size_t i = 0; i < count; ++i)
    derivatives[i] = derivatives_.read(*simulation_.table.real(references[i]));
  warn_of_singular_loops(function);
  return fmi2OK;
}

bool Instance::loops_are_singular() {
  return simulation_.system.has_constraints() &&
         simulation_.system.independent_rows() < simulation_.independent().rank();
}

void Instance::warn_of_singular_loops(Function function) {
  if (life_.state != State::initialization && loops_are_singular())
    log_.warning(name_of(function) + ": " + singular_loops);
}

}  // namespace redysim
