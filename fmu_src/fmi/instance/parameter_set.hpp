#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fmi/instance/current_state.hpp"

namespace redysim {

// The parameters as the master has set them, and whether the plan contains them.
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
  // The state that the master gives is part of the parameters: `state.apply` was set, or it has replaced the
  // state.
  enum class Given : std::uint8_t { none, due, applied };
  // After a change of a prescribed motion or of the given values: they replace the state once more.
  void give_again() {
    if (pending_.given == Given::applied) pending_.given = Given::due;
  }
  bool void_history() const { return pending_.changed || pending_.given != Given::none; }  // of the solver
  Given given() const { return pending_.given; }
  bool state_is_due() const { return pending_.given == Given::due && simulation_.integrator; }

  bool in_force() const { return pending_.in_force && !state_is_due(); }
  // Applies the values to the plan, and the given state. Returns why they are contradictory, leave a joint
  // without inertia or cannot satisfy the loops, empty on success.
  std::string bring_into_force();

  // What decides how they are brought into force.
  struct Pending {
    bool in_force = true, changed = false;
    bool inertia_tuned = false;  // since the plan was current
    Given given = Given::none;
  };
  const Pending& pending() const { return pending_; }
  void restored(const Pending& pending);

  std::string impossible() const;  // contradictory values; empty: none
  std::string immovable();         // joint without inertia in every pose; empty: none. Uses the workspace
  double energy_offset = 0;        // the energy balance starts at 0

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
