#include <algorithm>
#include <cmath>
#include <limits>

#include "fmi/boundary/arrays.hpp"
#include "fmi/instance/instance.hpp"
#include "fmi/variables/parameters.hpp"
#include "model/features.hpp"
#include "model/number.hpp"
#include "model/solver_methods.hpp"

// Reading and writing variables by value reference.

namespace redysim {

std::string Instance::unknown_reference(unsigned reference, VariableType type) const {
  const bool fmi3 = log_.version() == FmiVersion::three;
  if (fmi3 && reference == 0)
    return "time is the independent variable: it cannot be set, and has no derivatives";
  const char* text = type == VariableType::real      ? (fmi3 ? "Float64" : "Real")
                     : type == VariableType::integer ? (fmi3 ? "Int32" : "Integer")
                                                     : "String";
  return "there is no " + std::string(text) + " variable with value reference " + std::to_string(reference);
}

void Instance::append_elements(unsigned reference, std::vector<unsigned>& elements) const {
  const Variable* first =
      reference >= array_reference ? simulation_.table.real(reference - array_reference) : nullptr;
  std::vector<unsigned> found;
  if (first) found = simulation_.table.array({simulation_.model, simulation_.plan}, *first);
  if (found.empty()) found.push_back(reference);
  elements.insert(elements.end(), found.begin(), found.end());
}

// Needs of the first variable, or those of a later one that include them.
Needs Instance::needs_of(const unsigned* references, std::size_t count) const {
  const Needs first = simulation_.table.real(*references)->row->needs;
  if (first != Needs::step_jacobian) return first;
  for (std::size_t i = 1; i < count; ++i) {
    const Variable* variable = simulation_.table.real(references[i]);
    if (variable && variable->row->needs == Needs::step_jacobian_by_knowns) return variable->row->needs;
  }
  return first;
}

fmi2Status Instance::get_real(const unsigned* references, std::size_t count, double* values) {
  constexpr Function function = Function::get_real;
  if (const char* why = objection_to_arrays(count, {references, values})) return refuse(function, why);
  const Row* before = nullptr;  // row whose needs are up to date
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = simulation_.table.real(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], VariableType::real));
    if (life_.state == State::instantiated && variable->is_calculated())
      return refuse(function, variable->name + " has no value before initialization mode");
    if (variable->row != before && !values_.are_current(variable->row->needs)) {
      const std::string why = values_.update(needs_of(references + i, count - i));
      if (!why.empty())
        return life_.state == State::continuous ? discard(function, why, values, count)
                                                : refuse(function, why);
    }
    before = variable->row;
    values[i] = values_.read(*variable);
    if (std::isfinite(values[i])) continue;
    const std::string why = variable->name + " is not finite: " + shown(values[i]);
    return life_.state == State::continuous ? discard(function, why, values, count) : refuse(function, why);
  }
  return fmi2OK;
}

fmi2Status Instance::get_integer(const unsigned* references, std::size_t count, int* values) {
  constexpr Function function = Function::get_integer;
  if (const char* why = objection_to_arrays(count, {references, values})) return refuse(function, why);
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = simulation_.table.integer(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], VariableType::integer));
    if (life_.state == State::instantiated && variable->is_calculated())
      return refuse(function, variable->name + " has no value before initialization mode");
    const double number = values_.read(*variable);
    values[i] = static_cast<int>(std::min<double>(number, std::numeric_limits<int>::max()));
  }
  return fmi2OK;
}

fmi2Status Instance::get_string(const unsigned* references, std::size_t count, fmi2String* values) {
  constexpr Function function = Function::get_string;
  if (const char* why = objection_to_arrays(count, {references, values})) return refuse(function, why);
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = simulation_.table.string(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], VariableType::string));
    values[i] = variable->is_calculated() ? values_.independent_joint(variable->element).c_str()
                                          : method_name(simulation_.parameters.solver.method);
  }
  return fmi2OK;
}

std::string Instance::objection_to_setting(const Variable& variable) const {
  if (is_given_state(variable)) return {};
  if (variable.is_calculated())
    return variable.name +
           (variable.causality() == Causality::output ? " is an output" : " is a local variable") +
           " and cannot be set";
  if (variable.variability() == Variability::fixed && simulation_.integrator)
    return variable.name + " is a fixed parameter and cannot be set after initialization";
  if (variable.causality() == Causality::parameter && life_.state == State::continuous)
    return variable.name + " is a tunable parameter and can be set in event mode only";
  return {};
}

// Whether the variable accepts every finite number in each state that allows setting.
static bool takes_any_number(const Variable& variable) {
  return variable.causality() == Causality::input && variable.row->bounds == Bounds::none;
}

fmi2Status Instance::set_real(const unsigned* references, std::size_t count, const double* values) {
  constexpr Function function = Function::set_real;
  if (const char* why = objection_to_arrays(count, {references, values})) return refuse(function, why);
  // check all values before setting the first
  bool has_states = false;
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = simulation_.table.real(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], VariableType::real));
    if (takes_any_number(*variable) && std::isfinite(values[i])) continue;
    has_states |= variable->is_calculated();
    std::string why = objection_to_setting(*variable);
    if (why.empty()) why = objection(*variable, values[i]);
    if (!why.empty()) return refuse(function, why);
  }
  if (has_states && !set_states(references, count, values)) return refuse(function, zero_quaternion);
  for (std::size_t i = 0; i < count; ++i) {
    const Variable& variable = *simulation_.table.real(references[i]);
    if (!variable.is_calculated()) set_value(variable, values[i]);
  }
  return fmi2OK;
}

void Instance::set_value(const Variable& variable, double value) {
  const Row& row = *variable.row;
  if (variable.is_motion()) {
    set_motion(variable.joint, row.motion_order, value);
    return;
  }
  System& system = simulation_.system;
  double& place = row.storage == Storage::input
                      ? system.inputs()[variable.group->input(variable.row_index(), system, variable)]
                      : *parameter(simulation_.parameters, variable);
  if (place == value) return;
  place = value;
  values_.changed();
  parameters_.set(variable);
  if (simulation_.model.starts_in_equilibrium) state_.start_changed();
  if (variable.variability() != Variability::fixed) return;
  state_.start_changed();
  if (row.acts & acts::position) motion_.set_locked(variable, value);
}

void Instance::set_motion(int joint, int order, double value) {
  // the energy balance is kept across the change of parameters, not across that of the motion
  if (simulation_.model_exchange) parameters_.bring_into_force();
  if (!motion_.set(joint, order, value)) return;
  values_.changed();
  state_.motion_changed();
  parameters_.give_again();
}

fmi2Status Instance::set_integer(const unsigned* references, std::size_t count, const int* values) {
  constexpr Function function = Function::set_integer;
  if (const char* why = objection_to_arrays(count, {references, values})) return refuse(function, why);
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = simulation_.table.integer(references[i]);
    const std::string why =
        variable ? objection_to_setting(*variable) : unknown_reference(references[i], VariableType::integer);
    if (!why.empty()) return refuse(function, why);
  }
  for (std::size_t i = 0; i < count; ++i) set_value(*simulation_.table.integer(references[i]), values[i]);
  return fmi2OK;
}

fmi2Status Instance::set_string(const unsigned* references, std::size_t count, const fmi2String* values) {
  constexpr Function function = Function::set_string;
  if (const char* why = objection_to_arrays(count, {references, values})) return refuse(function, why);
  SolverMethod method = simulation_.parameters.solver.method;
  for (std::size_t i = 0; i < count; ++i) {
    const Variable* variable = simulation_.table.string(references[i]);
    if (!variable) return refuse(function, unknown_reference(references[i], VariableType::string));
    const std::string why = objection_to_setting(*variable);
    if (!why.empty()) return refuse(function, why);
    if (!values[i]) return refuse(function, null_pointer);
    if (!parse_method(values[i], method))
      return refuse(function, variable->name + " must be " + method_names() + ", got '" + values[i] + "'");
  }
  if (const std::string why = objection_to_method(method); !why.empty()) return refuse(function, why);
  simulation_.parameters.solver.method = method;
  return fmi2OK;
}

fmi2Status Instance::no_booleans(Function function, std::size_t count) {
  return count == 0 ? fmi2OK : refuse(function, "there are no Boolean variables");
}

}  // namespace redysim
