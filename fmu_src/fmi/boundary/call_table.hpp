#pragma once

#include <string>

// States in which each function may be called: FMI 2.0.4, tables of sections 3.2.3 and 4.2.4, as one table.
// The functions of FMI 3.0 share its rows.

namespace redysim {

// State of an instance. `failed` follows a failed step, until the instance is reset, restored or freed.
// Co-simulation has `step` and, in a callback during a step, `intermediate`; model exchange has `event` and
// `continuous`.
enum class State : unsigned {
  instantiated = 1,
  initialization = 2,
  step = 4,
  failed = 8,
  terminated = 16,
  event = 32,
  continuous = 64,
  intermediate = 128
};

enum class Function {
  set_debug_logging,
  setup_experiment,
  enter_initialization_mode,
  exit_initialization_mode,
  terminate,
  reset,
  get_real,
  get_integer,
  get_boolean,
  get_string,
  set_real,
  set_integer,
  set_boolean,
  set_string,
  get_fmu_state,
  set_fmu_state,
  free_fmu_state,
  serialized_fmu_state_size,
  serialize_fmu_state,
  deserialize_fmu_state,
  get_directional_derivative,
  get_adjoint_derivative,
  set_real_input_derivatives,
  get_real_output_derivatives,
  do_step,
  cancel_step,
  get_status,
  get_real_status,
  get_integer_status,
  get_boolean_status,
  get_string_status,
  enter_event_mode,
  new_discrete_states,
  enter_continuous_time_mode,
  completed_integrator_step,
  set_time,
  set_continuous_states,
  get_continuous_states,
  get_derivatives,
  get_nominals,
  get_event_indicators,
  get_number_of_continuous_states,
  get_number_of_event_indicators,
};

enum class FmiVersion { two = 2, three = 3 };

// The function's name in the standard.
std::string name(Function function, FmiVersion version = FmiVersion::two);
const char* name(State state);
bool is_allowed(Function function, State state);
// Why an instance for model exchange, or one for co-simulation, does not have the function; null if it does.
const char* objection_to_kind(Function function, bool model_exchange);

}  // namespace redysim
