#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fmi/instance/current_state.hpp"

namespace redysim {

// The parameters as set by the master, and whether the plan contains them.
class ParameterSet {
 public:
  ParameterSet(Simulation& simulation, CurrentState& state)
      : simulation_(simulation), state_(state), size_(values().size()) {}

  void reset();  // to the values of the model file
  std::size_t size() const { return size_; }
  std::vector<double> values() const;  // of the Real parameters, in table order
  void exchange(std::vector<double>& values, SolverMethod& method);

  // Notes that a value was set.
  void set(const Variable& variable);
  bool changed() const { return pending_.changed; }  // since the last step
  void stepped() {
    pending_.changed = false;
    if (!state_is_due()) pending_.given = Given::none;
  }
  // State set by the master through parameters: none; `state.apply` was set; it has replaced the state.
  enum class Given : std::uint8_t { none, due, applied };
  // Call after a change of a prescribed motion, a parameter or the given values: the given state is applied
  // again.
  void give_again() {
    if (pending_.given == Given::applied) pending_.given = Given::due;
  }
  // Whether the solver must discard its history.
  bool void_history() const { return pending_.changed || pending_.given != Given::none; }
  Given given() const { return pending_.given; }
  bool state_is_due() const { return pending_.given == Given::due && simulation_.integrator; }

  bool in_force() const { return pending_.in_force && !state_is_due(); }
  // Applies the values to the plan, then the given state. Returns why the values are inconsistent, leave a
  // joint without inertia or cannot satisfy the loops; empty on success.
  std::string bring_into_force();

  // Flags that determine the next bring_into_force.
  struct Pending {
    bool in_force = true, changed = false;
    bool inertia_tuned = false;  // since the last update of the plan
    Given given = Given::none;
  };
  const Pending& pending() const { return pending_; }
  void restored(const Pending& pending);

  std::string impossible() const;  // inconsistent values; empty: none
  std::string immovable();         // joint without inertia in every pose; empty: none. Uses the workspace
  double energy_offset = 0;        // makes the energy balance start at 0

 private:
  void renew_plan();
  double energy();
  std::string apply_state();

  Simulation& simulation_;
  CurrentState& state_;
  const std::size_t size_;
  Pending pending_;
};

}  // namespace redysim
