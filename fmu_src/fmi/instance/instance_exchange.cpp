#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "fmi/boundary/arrays.hpp"
#include "fmi/instance/instance.hpp"
#include "integrate/methods/given_state.hpp"
#include "model/number.hpp"

// Model exchange: the master integrates the states y.

namespace redysim {
namespace {

// Relative tolerance for reaching a time event, since masters may accumulate step sizes.
constexpr double time_slack = 1e-12;

}  // namespace

GivenState& Instance::given() const { return static_cast<GivenState&>(*simulation_.integrator); }

// Why the array cannot hold `size` numbers; empty: it can.
std::string Instance::objection_to_array(const double* array, std::size_t count, int size, const char* what) {
  if (count != static_cast<std::size_t>(size))
    return "the model has " + std::to_string(size) + what + std::to_string(count);
  const char* why = objection_to_arrays(count, {array});
  return why ? why : "";
}

std::string Instance::objection_to_states(const double* array, std::size_t count) {
  return objection_to_array(array, count, simulation_.independent().size(), " continuous states, got ");
}

// Whether a quaternion must be normalised. The motion does not depend on its length.
bool Instance::is_stretched() const {
  const double tolerance =
      std::isfinite(life_.tolerance) ? life_.tolerance : simulation_.parameters.solver.rtol;
  return given().stretch() > std::clamp(100 * tolerance, 1e-8, 1e-3);
}

bool Instance::should_choose(double accepted) {
  return simulation_.independent().leverage(simulation_.time, state_.y()) > accepted;
}

// Tools without state events that complete steps rarely can pass singular configurations of the coordinates.
void Instance::report_singular(Function function) {
  const char* what = "the motion can be wrong near singular independent coordinates: use the event indicator";
  if (loops_are_singular())
    what = singular_loops;
  else if (!simulation_.integrator || !given().is_far() ||
           !should_choose(IndependentCoordinates::nearly_singular))
    return;
  log_.warning(name_of(function) + ": " + what + ", at " + shown(simulation_.time) + " s");
  singular_is_reported_ = true;
}

// Normalises quaternions and chooses new independent coordinates if necessary. Returns why the loop
// constraints cannot be satisfied, empty on success.
std::string Instance::settle_states(bool& changed) {
  const bool stretched = is_stretched();
  const double* y = state_.y();
  if (!state_.can_follow())
    return "the loop constraints cannot be satisfied at " + shown(simulation_.time) + " s";
  const bool chosen = should_choose(IndependentCoordinates::usual);
  changed = stretched || chosen;
  given().keep(y);
  if (stretched) given().normalise();
  if (chosen) given().choose();
  nominals_are_new_ |= chosen;
  states_given();
  if (changed && log_.events()) {
    log_.event((chosen ? "independent coordinates chosen at " : "quaternions normalised at ") +
               shown(simulation_.time) + " s");
  }
  return {};
}

void Instance::states_given() {
  state_.given();
  values_.changed();
}

fmi2Status Instance::enter_event_mode() {
  life_.state = State::event;
  return fmi2OK;
}

fmi2Status Instance::new_discrete_states(fmi2EventInfo* info) {
  constexpr Function function = Function::new_discrete_states;
  if (!info) return refuse(function, null_pointer);
  if (!motion_.is_reported()) report_unset_motion();
  System& system = simulation_.system;
  bool states_changed = false;
  std::string why = parameters_.bring_into_force();
  if (why.empty()) why = settle_states(states_changed);
  if (!why.empty()) return refuse(function, why);
  states_changed |= parameters_.given() == ParameterSet::Given::applied;
  parameters_.stepped();

  double time = simulation_.time;
  const double due = system.next_breakpoint(time);  // time at which knots, phases and samples are entered
  if (due - time <= time_slack * std::max(1.0, std::abs(time))) time = due;
  system.enter_phases(time);
  system.enter_samples(time, state_.y());
  if (system.control()) values_.changed();
  const double next = system.next_breakpoint(time);
  *info = {};
  info->nominalsOfContinuousStatesChanged = nominals_are_new_;
  info->valuesOfContinuousStatesChanged = states_changed;
  info->nextEventTimeDefined = std::isfinite(next);
  info->nextEventTime = std::isfinite(next) ? next : 0;
  nominals_are_new_ = false;
  return fmi2OK;
}

fmi2Status Instance::enter_continuous_time_mode() {
  life_.state = State::continuous;
  return fmi2OK;
}

fmi2Status Instance::completed_integrator_step(fmi2Boolean* enter_event_mode, fmi2Boolean* terminate) {
  if (!enter_event_mode || !terminate) return refuse(Function::completed_integrator_step, null_pointer);
  const double* y = state_.y();
  const bool is_closed = state_.can_follow();
  if (is_closed) given().completed_step(y);
  *enter_event_mode = is_closed && (is_stretched() || should_choose(IndependentCoordinates::usual));
  *terminate = fmi2False;
  if (simulation_.system.has_constraints()) states_given();
  return fmi2OK;
}

// At any time, prescribed motions have the values set last.
fmi2Status Instance::set_time(double time) {
  if (!std::isfinite(time)) return refuse(Function::set_time, "the time must be finite, got " + shown(time));
  simulation_.time = time;
  given().set_time(time);
  motion_.hold();
  states_given();
  return fmi2OK;
}

fmi2Status Instance::set_continuous_states(const double* states, std::size_t count) {
  constexpr Function function = Function::set_continuous_states;
  if (const std::string why = objection_to_states(states, count); !why.empty()) return refuse(function, why);
  for (std::size_t i = 0; i < count; ++i)
    if (!std::isfinite(states[i]))
      return refuse(function, "state " + std::to_string(i + 1) + " must be finite, got " + shown(states[i]));
  if (!given().set(states)) return refuse(function, zero_quaternion);
  states_given();
  return fmi2OK;
}

// Allowed beyond the standard: CasADi sets states as variables.
bool Instance::is_given_state(const Variable& variable) const {
  return (life_.state == State::event || life_.state == State::continuous) &&
         values_.exchanged_place(variable) >= 0;
}

// Sets the states among the variables; false: a quaternion would be zero.
bool Instance::set_states(const unsigned* references, std::size_t count, const double* values) {
  std::vector<double> states(static_cast<std::size_t>(simulation_.independent().size()));
  given().get(states.data());
  for (std::size_t i = 0; i < count; ++i) {
    const Variable& variable = *simulation_.table.real(references[i]);
    if (variable.is_calculated())
      states[static_cast<std::size_t>(values_.exchanged_place(variable))] = values[i];
  }
  if (!given().set(states.data())) return false;
  states_given();
  return true;
}

fmi2Status Instance::get_continuous_states(double* states, std::size_t count) {
  constexpr Function function = Function::get_continuous_states;
  if (const std::string why = objection_to_states(states, count); !why.empty()) return refuse(function, why);
  if (simulation_.integrator) {
    given().get(states);
  } else {
    GivenState start(simulation_.system, simulation_.independent());
    start.start(simulation_.time, state_.y());
    start.get(states);
  }
  return fmi2OK;
}

fmi2Status Instance::get_derivatives(double* derivatives, std::size_t count) {
  constexpr Function function = Function::get_derivatives;
  if (const std::string why = objection_to_states(derivatives, count); !why.empty())
    return refuse(function, why);
  std::string why = values_.update(Needs::parameters);
  if (!why.empty()) return refuse(function, why);
  why = values_.update(Needs::slopes);
  if (!why.empty()) return discard(function, why, derivatives, count);
  if (!singular_is_reported_) report_singular(function);
  const IndependentCoordinates& of = state_.independent();
  const double* slopes = values_.slopes().data();
  for (int i : of.kept()) *derivatives++ = slopes[i];
  for (int k = 0; k < of.count(); ++k) {
    const IndependentCoordinates::Motion motion = values_.independent(k);
    derivatives[k] = motion.qd;
    derivatives[of.count() + k] = motion.qdd;
  }
  return fmi2OK;
}

fmi2Status Instance::get_nominals(double* nominals, std::size_t count) {
  constexpr Function function = Function::get_nominals;
  if (const std::string why = objection_to_states(nominals, count); !why.empty())
    return refuse(function, why);
  state_.independent().nominals(nominals);
  return fmi2OK;
}

fmi2Status Instance::get_event_indicators(double* indicators, std::size_t count) {
  constexpr Function function = Function::get_event_indicators;
  std::string why = objection_to_array(indicators, count, event_indicators(), " event indicators, got ");
  if (why.empty()) why = values_.update(Needs::parameters);
  if (!why.empty()) return refuse(function, why);
  if (count > 0) *indicators = values_.margin();
  return fmi2OK;
}

int Instance::event_indicators() const { return simulation_.system.has_constraints(); }

// Number of continuous states or event indicators.
fmi2Status Instance::get_number(Function function, std::size_t* count) {
  if (!count) return refuse(function, null_pointer);
  const bool of_states = function == Function::get_number_of_continuous_states;
  *count = static_cast<std::size_t>(of_states ? simulation_.independent().size() : event_indicators());
  return fmi2OK;
}

}  // namespace redysim
