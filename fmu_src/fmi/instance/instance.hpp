#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "dynamics/assembly/assembly.hpp"
#include "fmi/boundary/call_table.hpp"
#include "fmi/boundary/log.hpp"
#include "fmi/variables/variables.hpp"
#include "fmi2Functions.h"
#include "integrate/methods/integrator.hpp"
#include "integrate/system/system.hpp"
#include "integrate/system/tangent.hpp"
#include "model/read/model_file.hpp"

namespace redysim {

// One simulation: the model with its current parameters, the state, and where in its life it is.
// Functions answer like their namesakes in the standard and log why they refuse; whether the state allows
// a call is asked before (call_table.hpp). A refused call changes nothing.
class Instance {
 public:
  Instance(const Log& log, Model model, std::string guid);

  State state() const { return state_; }
  Log& log() { return log_; }

  // life (instance.cpp)
  fmi2Status set_debug_logging(bool on, std::size_t count, const fmi2String* categories);
  fmi2Status setup_experiment(bool has_tolerance, double tolerance, double start, bool has_stop, double stop);
  fmi2Status enter_initialization_mode();
  fmi2Status exit_initialization_mode();
  fmi2Status do_step(double current, double size);
  fmi2Status terminate();
  fmi2Status reset();
  double last_successful_time() const { return time_; }
  fmi2Status last_step_status() const { return state_ == State::failed ? fmi2Error : fmi2OK; }

  // values (instance_values.cpp)
  fmi2Status get_real(const unsigned* references, std::size_t count, double* values);
  fmi2Status get_integer(const unsigned* references, std::size_t count, int* values);
  fmi2Status get_string(const unsigned* references, std::size_t count, fmi2String* values);
  fmi2Status set_real(const unsigned* references, std::size_t count, const double* values);
  fmi2Status set_integer(const unsigned* references, std::size_t count);
  fmi2Status set_string(const unsigned* references, std::size_t count, const fmi2String* values);
  fmi2Status no_booleans(Function function, std::size_t count);
  fmi2Status set_real_input_derivatives(const unsigned* references, std::size_t count, const int* orders,
                                        const double* values);
  fmi2Status get_directional_derivative(const unsigned* unknowns, std::size_t unknown_count,
                                        const unsigned* knowns, std::size_t known_count,
                                        const double* directions, double* derivatives);
  fmi2Status get_real_output_derivatives(const unsigned* references, std::size_t count, const int* orders,
                                         double* values);

  // saved states (instance_state.cpp)
  fmi2Status get_fmu_state(fmi2FMUstate* saved);
  fmi2Status set_fmu_state(fmi2FMUstate saved);
  fmi2Status free_fmu_state(fmi2FMUstate* saved);
  fmi2Status serialized_size(fmi2FMUstate saved, std::size_t* size);
  fmi2Status serialize(fmi2FMUstate saved, fmi2Byte* bytes, std::size_t size);
  fmi2Status deserialize(const fmi2Byte* bytes, std::size_t size, fmi2FMUstate* saved);

  // Logs "<function>: <why>" and returns fmi2Error.
  fmi2Status refuse(Function function, const std::string& why);

 private:
  using Bytes = std::vector<unsigned char>;

  SolverSettings effective_settings() const;
  void restore_start_values();
  void report_drives();
  void report_unset_motion();
  void note_travel();
  void report_short_travel();
  void values_changed();          // all that is computed on demand is stale
  const double* current_state();  // y, in every state of the instance
  bool update_plan(Function function);
  std::string impossible_parameter() const;
  std::string why_immovable();
  std::string why_immovable_at_start();
  void renew_plan();
  bool update_accelerations(Function function);
  bool update_energies(Function function);
  double read_frame(const Variable& variable);
  double read_momentum(const Variable& variable);
  double read_multiplier(const Variable& variable);
  int force_index(const Variable& variable) const;
  static std::string unknown_reference(unsigned reference, const char* type);
  std::string why_no_direction(const Variable& variable, double direction) const;
  bool take_tangent(Function function);
  void set_direction(const Variable& variable, double direction);
  void set_parameter_direction(const Variable& variable, double direction);
  void set_resistance_direction(Plan<Dual>& plan, const Variable& variable, double direction);
  fmi2Status read_tangent(Function function, const unsigned* references, std::size_t count,
                          double* derivatives);
  double read_direction(const Variable& variable);
  double energy_direction(Role role);
  void set_input_derivative(const Variable& variable, int order, double value);
  double& settable_value(const Variable& variable);
  void set_motion(const Variable& variable, double value);
  void take_start_motion();
  void anchor_motion();
  void end_input_slopes(double time);
  const double* settle();
  bool start_is_closed(Function function);
  bool read(Function function, const Variable& variable, double& value);
  std::string why_not_settable(const Variable& variable) const;
  std::string failed_joint_name() const;

  void save(Bytes& bytes);
  bool restore(const Bytes& bytes);
  Bytes* find_saved(fmi2FMUstate saved);
  Bytes& add_saved(fmi2FMUstate* saved);
  Bytes serial_kind() const;
  Bytes serial_header(const unsigned char* bytes, std::size_t size) const;

  Log log_;
  std::string guid_;
  Model model_;  // with the current parameters
  Plan<double> plan_;
  VariableTable table_;
  System system_;                     // uses plan_; holds the inputs
  std::vector<double> start_values_;  // of the Real parameters, in table order
  SolverMethod start_method_;

  State state_ = State::instantiated;
  double start_time_ = 0;
  double stop_time_ = std::numeric_limits<double>::infinity();
  double tolerance_ = std::numeric_limits<double>::infinity();  // the master's
  double time_ = 0;                                             // of the last communication point
  double energy_offset_ = 0;                                    // so that energy.balance starts at 0
  bool parameters_changed_ = false;                             // since the last step
  bool inertia_tuned_ = false;  // a mass, inertia or armature, since the plan was current

  std::unique_ptr<Integrator> integrator_;  // from the end of initialization on
  SolverSettings integrator_settings_;      // that it was made with
  std::vector<double> applied_inputs_;      // of the last step
  std::vector<double> motion_;              // per joint: the prescribed q, qd, qdd as last set
  std::vector<unsigned char> motion_set_;   // which of them the master ever set
  struct Travel {
    double start, farthest;
  };
  std::vector<Travel> travel_;   // of the joints in the state
  bool motion_checked_ = false;  // report_unset_motion was asked
  bool settled_state_current_ = false;
  bool landed_ = true;   // false: the settled state cannot follow, the next step will say so
  bool settled_ = true;  // false: the state has to follow a motion set since the last step

  Assembly assembly_;  // of the start pose

  std::unique_ptr<Tangent> tangent_;  // from the first derivative asked for on
  enum class WorkChange { none, of_energy, by_power } work_change_ = WorkChange::none;

  // computed on demand
  std::vector<double> start_state_, settled_state_, qdd_, drive_;
  std::vector<Vec3<double>> ball_alpha_;
  double kinetic_energy_ = 0, potential_energy_ = 0;
  bool plan_current_ = true, start_state_current_ = false, qdd_current_ = false, energies_current_ = false;

  std::vector<std::unique_ptr<Bytes>> saved_;  // what the master was given and has not freed
  Bytes integrator_bytes_;
};

}  // namespace redysim
