#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "fmi/boundary/log.hpp"
#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/life.hpp"
#include "fmi/instance/saved_states.hpp"
#include "fmi/instance/travel.hpp"
#include "fmi2Functions.h"
#include "fmi3FunctionTypes.h"

namespace redysim {

class GivenState;
struct Snapshot;

// FMI 3.0 callback after each internal step before the end of a communication step; null: none.
struct IntermediateUpdate {
  fmi3IntermediateUpdateCallback callback = nullptr;
  fmi3InstanceEnvironment environment = nullptr;
  bool may_return_early = false;
};

// One FMI instance: its parts and the functions of the standard. The FMI state is checked before each call
// (call_table.hpp). A function that refuses a call logs the reason and changes nothing.
class Instance {
 public:
  Instance(const Log& log, Model model, std::string guid, bool model_exchange = false);

  State state() const { return life_.state; }
  bool is_for_model_exchange() const { return simulation_.model_exchange; }
  Log& log() { return log_; }

  // life (instance.cpp)
  fmi2Status set_debug_logging(bool on, std::size_t count, const fmi2String* categories);
  fmi2Status setup_experiment(bool has_tolerance, double tolerance, double start, bool has_stop, double stop);
  fmi2Status enter_initialization_mode();
  fmi2Status exit_initialization_mode();
  fmi2Status do_step(double current, double size);
  void ask_for_updates(const IntermediateUpdate& update) { update_ = update; }
  fmi2Status terminate();
  fmi2Status reset();
  double last_successful_time() const { return simulation_.time; }
  fmi2Status last_step_status() const { return life_.state == State::failed ? fmi2Error : fmi2OK; }

  // values (instance_values.cpp)
  fmi2Status get_real(const unsigned* references, std::size_t count, double* values);
  fmi2Status get_integer(const unsigned* references, std::size_t count, int* values);
  fmi2Status get_string(const unsigned* references, std::size_t count, fmi2String* values);
  fmi2Status set_real(const unsigned* references, std::size_t count, const double* values);
  fmi2Status set_integer(const unsigned* references, std::size_t count, const int* values);
  fmi2Status set_string(const unsigned* references, std::size_t count, const fmi2String* values);
  void append_elements(unsigned reference,
                       std::vector<unsigned>& elements) const;  // of an array; otherwise the reference itself
  fmi2Status no_booleans(Function function, std::size_t count);

  // derivatives (instance_derivatives.cpp)
  fmi2Status set_real_input_derivatives(const unsigned* references, std::size_t count, const int* orders,
                                        const double* values);
  fmi2Status get_directional_derivative(const unsigned* unknowns, std::size_t unknown_count,
                                        const unsigned* knowns, std::size_t known_count,
                                        const double* directions, double* derivatives);
  fmi2Status get_adjoint_derivative(const unsigned* unknowns, std::size_t unknown_count,
                                    const unsigned* knowns, std::size_t known_count, const double* seed,
                                    double* sensitivity);
  fmi2Status get_real_output_derivatives(const unsigned* references, std::size_t count, const int* orders,
                                         double* values);

  // saved states (instance_states.cpp)
  fmi2Status get_fmu_state(fmi2FMUstate* saved);
  fmi2Status set_fmu_state(fmi2FMUstate saved);
  fmi2Status free_fmu_state(fmi2FMUstate* saved);
  fmi2Status serialized_size(fmi2FMUstate saved, std::size_t* size);
  fmi2Status serialize(fmi2FMUstate saved, fmi2Byte* bytes, std::size_t size);
  fmi2Status deserialize(const fmi2Byte* bytes, std::size_t size, fmi2FMUstate* saved);

  // model exchange (instance_exchange.cpp)
  fmi2Status enter_event_mode();
  fmi2Status new_discrete_states(fmi2EventInfo* info);
  fmi2Status enter_continuous_time_mode();
  fmi2Status completed_integrator_step(fmi2Boolean* enter_event_mode, fmi2Boolean* terminate);
  fmi2Status set_time(double time);
  fmi2Status set_continuous_states(const double* states, std::size_t count);
  fmi2Status get_continuous_states(double* states, std::size_t count);
  fmi2Status get_derivatives(double* derivatives, std::size_t count);
  fmi2Status get_nominals(double* nominals, std::size_t count);
  fmi2Status get_event_indicators(double* indicators, std::size_t count);
  fmi2Status get_number(Function function, std::size_t* count);

  // Logs "<function>: <why>" and returns fmi2Error.
  fmi2Status refuse(Function function, const std::string& why);
  // Whether rows of the loops were dependent in the last right-hand side: accelerations may then be wrong.
  bool loops_are_singular();
  void warn_of_singular_loops(Function function);
  // Values that are not finite in continuous-time mode are not an error of the master: a smaller step may
  // avoid them. Fills `values` with NaN, for masters that ignore the status.
  fmi2Status discard(Function function, const std::string& why, double* values, std::size_t count);
  std::string name_of(Function function) const { return name(function, log_.version()); }

 private:
  // These return the reason of a failed start, empty on success.
  std::string assemble_start();
  std::string immovable_at_start();
  std::string start_integrator();
  void report_drives();
  void report_contacts();
  void report_corners();
  void report_unset_motion();
  std::string failed_step(const Outcome& outcome);
  bool inputs_have_changed();
  void end_input_slopes(double time);
  Outcome advance_to(double& end, bool inputs_changed);
  Outcome advance_with_updates(double& end, bool inputs_changed);
  Needs needs_of(const unsigned* references, std::size_t count) const;

  // "there is no Real variable with value reference 7", with the type name of the FMI version
  std::string unknown_reference(unsigned reference, VariableType type) const;
  std::string objection_to_setting(const Variable& variable) const;
  void set_value(const Variable& variable, double value);
  void set_motion(int joint, int order, double value);
  void set_input_derivative(const Variable& variable, int order, double value);
  fmi2Status directional_derivative(Function function, const unsigned* unknowns, std::size_t unknown_count,
                                    const unsigned* knowns, std::size_t known_count, const double* directions,
                                    double* derivatives);
  fmi2Status read_derivatives(Function function, const unsigned* references, std::size_t count,
                              double* derivatives);

  static constexpr const char* singular_loops =
      "accelerations and derivatives may be wrong by several percent in this singular configuration of the "
      "closed loops";
  static constexpr const char* zero_quaternion = "a quaternion is zero or too long: it has no orientation";
  bool is_given_state(const Variable& variable) const;
  bool set_states(const unsigned* references, std::size_t count, const double* values);
  GivenState& given() const;
  std::string objection_to_array(const double* array, std::size_t count, int size, const char* what);
  std::string objection_to_states(const double* array, std::size_t count);
  int event_indicators() const;  // their number
  bool is_stretched() const;
  bool should_choose(double accepted);
  void report_singular(Function function);
  void states_given();
  std::string settle_states(bool& changed);

  void save(Bytes& bytes);
  bool restore(const Bytes& bytes);
  bool restore_integrator(Snapshot& saved);

  Log log_;
  std::string guid_;
  Simulation simulation_;
  Life life_;
  CurrentState state_;
  ParameterSet parameters_;
  PrescribedMotion motion_;
  Values values_;
  OutputDerivatives derivatives_;
  SavedStates saved_;
  Travel travel_;
  IntermediateUpdate update_;
  std::vector<double> applied_inputs_;  // at the end of the last step
  bool singular_is_reported_ = false;   // for accelerations
  bool nominals_are_new_ = false;       // since the last event, in model exchange
};

}  // namespace redysim
