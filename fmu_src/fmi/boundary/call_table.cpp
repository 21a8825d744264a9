#include "fmi/boundary/call_table.hpp"

namespace redysim {
namespace {

constexpr unsigned I = static_cast<unsigned>(State::instantiated);
constexpr unsigned M = static_cast<unsigned>(State::initialization);
constexpr unsigned S = static_cast<unsigned>(State::step);
constexpr unsigned F = static_cast<unsigned>(State::failed);
constexpr unsigned T = static_cast<unsigned>(State::terminated);
constexpr unsigned E = static_cast<unsigned>(State::event);
constexpr unsigned C = static_cast<unsigned>(State::continuous);
constexpr unsigned U = static_cast<unsigned>(State::intermediate);

// Character arrays: pointers would need relocation when the library is loaded.
struct Row {
  Function function;
  char name[34];
  unsigned states;
};
struct Name {
  Function function;
  char text[34];
};

// In `instantiated`, reading is allowed beyond the standard: parameters and inputs have their start values
// there.
constexpr Row rows[] = {
    {Function::set_debug_logging, "fmi2SetDebugLogging", I | M | S | F | T | E | C},
    {Function::setup_experiment, "fmi2SetupExperiment", I},
    {Function::enter_initialization_mode, "fmi2EnterInitializationMode", I},
    {Function::exit_initialization_mode, "fmi2ExitInitializationMode", M},
    {Function::terminate, "fmi2Terminate", S | F | E | C},
    {Function::reset, "fmi2Reset", I | M | S | F | T | E | C},
    {Function::get_real, "fmi2GetReal", I | M | S | F | T | E | C | U},
    {Function::get_integer, "fmi2GetInteger", I | M | S | F | T | E | C},
    {Function::get_boolean, "fmi2GetBoolean", I | M | S | F | T | E | C},
    {Function::get_string, "fmi2GetString", I | M | S | F | T | E | C},
    {Function::set_real, "fmi2SetReal", I | M | S | E | C},
    {Function::set_integer, "fmi2SetInteger", I | M | S | E},
    {Function::set_boolean, "fmi2SetBoolean", I | M | S | E},
    {Function::set_string, "fmi2SetString", I | M | S | E},
    {Function::get_fmu_state, "fmi2GetFMUstate", I | M | S | F | T | E | C},
    {Function::set_fmu_state, "fmi2SetFMUstate", I | M | S | F | T | E | C},
    {Function::free_fmu_state, "fmi2FreeFMUstate", I | M | S | F | T | E | C},
    {Function::serialized_fmu_state_size, "fmi2SerializedFMUstateSize", I | M | S | F | T | E | C},
    {Function::serialize_fmu_state, "fmi2SerializeFMUstate", I | M | S | F | T | E | C},
    {Function::deserialize_fmu_state, "fmi2DeSerializeFMUstate", I | M | S | F | T | E | C},
    {Function::get_directional_derivative, "fmi2GetDirectionalDerivative", M | S | F | T | E | C},
    {Function::get_adjoint_derivative, "fmi3GetAdjointDerivative", M | S | F | T | E | C},
    {Function::set_real_input_derivatives, "fmi2SetRealInputDerivatives", I | M | S},
    {Function::get_real_output_derivatives, "fmi2GetRealOutputDerivatives", S | F | T | U},
    {Function::do_step, "fmi2DoStep", S},
    {Function::cancel_step, "fmi2CancelStep", 0},  // steps are synchronous
    {Function::get_status, "fmi2GetStatus", S | F | T},
    {Function::get_real_status, "fmi2GetRealStatus", S | F | T},
    {Function::get_integer_status, "fmi2GetIntegerStatus", S | F | T},
    {Function::get_boolean_status, "fmi2GetBooleanStatus", S | F | T},
    {Function::get_string_status, "fmi2GetStringStatus", S | F | T},
    {Function::enter_event_mode, "fmi2EnterEventMode", E | C},
    {Function::new_discrete_states, "fmi2NewDiscreteStates", E},
    {Function::enter_continuous_time_mode, "fmi2EnterContinuousTimeMode", E},
    {Function::completed_integrator_step, "fmi2CompletedIntegratorStep", C},
    {Function::set_time, "fmi2SetTime", E | C},
    {Function::set_continuous_states, "fmi2SetContinuousStates", C},
    {Function::get_continuous_states, "fmi2GetContinuousStates", M | E | C | T},
    {Function::get_derivatives, "fmi2GetDerivatives", M | E | C | T},
    {Function::get_nominals, "fmi2GetNominalsOfContinuousStates", I | M | E | C | T},
    {Function::get_event_indicators, "fmi2GetEventIndicators", M | E | C | T},
    {Function::get_number_of_continuous_states, "fmi3GetNumberOfContinuousStates", I | M | E | C | T},
    {Function::get_number_of_event_indicators, "fmi3GetNumberOfEventIndicators", I | M | E | C | T},
};

// Functions whose FMI 3.0 name differs by more than the prefix fmi3.
constexpr Name names_of_fmi3[] = {
    {Function::setup_experiment, "fmi3EnterInitializationMode"},
    {Function::get_real, "fmi3GetFloat64"},
    {Function::get_integer, "fmi3GetInt32"},
    {Function::set_real, "fmi3SetFloat64"},
    {Function::set_integer, "fmi3SetInt32"},
    {Function::get_fmu_state, "fmi3GetFMUState"},
    {Function::set_fmu_state, "fmi3SetFMUState"},
    {Function::free_fmu_state, "fmi3FreeFMUState"},
    {Function::serialized_fmu_state_size, "fmi3SerializedFMUStateSize"},
    {Function::serialize_fmu_state, "fmi3SerializeFMUState"},
    {Function::deserialize_fmu_state, "fmi3DeserializeFMUState"},
    {Function::get_real_output_derivatives, "fmi3GetOutputDerivatives"},
    {Function::new_discrete_states, "fmi3UpdateDiscreteStates"},
    {Function::get_derivatives, "fmi3GetContinuousStateDerivatives"},
};

constexpr bool in_order() {
  int i = 0;
  for (const Row& row : rows)
    if (row.function != static_cast<Function>(i++)) return false;
  return true;
}
static_assert(in_order(), "one row a function, in the order of the enumeration");

const Row& row_of(Function function) { return rows[static_cast<int>(function)]; }

}  // namespace

std::string name(Function function, FmiVersion version) {
  std::string result = row_of(function).name;
  if (version == FmiVersion::two) return result;
  for (const Name& renamed : names_of_fmi3)
    if (renamed.function == function) return renamed.text;
  result[3] = '3';
  return result;
}

const char* name(State state) {
  switch (state) {
    case State::instantiated:
      return "instantiated";
    case State::initialization:
      return "in initialization mode";
    case State::step:
      return "at a communication point";
    case State::failed:
      return "stopped by a failed step";
    case State::terminated:
      return "terminated";
    case State::event:
      return "in event mode";
    case State::continuous:
      return "in continuous-time mode";
    case State::intermediate:
      return "in intermediate update mode";
  }
  return "";
}

bool is_allowed(Function function, State state) {
  return (row_of(function).states & static_cast<unsigned>(state)) != 0;
}

const char* objection_to_kind(Function function, bool model_exchange) {
  if (function >= Function::enter_event_mode)
    return model_exchange ? nullptr : "a function of model exchange only";
  return model_exchange && function >= Function::set_real_input_derivatives
             ? "a function of co-simulation only"
             : nullptr;
}

}  // namespace redysim
