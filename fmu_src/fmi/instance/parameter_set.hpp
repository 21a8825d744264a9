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
  bool changed() const { return changed_; }  // since the last step
  void stepped() {
    changed_ = false;
    if (!state_is_due()) given_ = Given::none;
  }
  // The state that the master gives is part of the parameters: `state.apply` was set, or it has replaced the
  // state.
  enum class Given : std::uint8_t { none, due, applied };
  bool void_history() const { return changed_ || given_ != Given::none; }  // of the solver
  Given given() const { return given_; }
  bool state_is_due() const { return given_ == Given::due && simulation_.integrator; }

  bool in_force() const { return in_force_ && !state_is_due(); }
  // Applies the values to the plan, and the given state. Returns why they are contradictory, leave a joint
  // without inertia or cannot satisfy the loops, empty on success.
  std::string bring_into_force();
  // The same if the values are consistent. The energy balance keeps its value: tuning is not an energy error.
  void bring_into_force_if_possible();
  void restored(bool changed, Given given);

  std::string impossible() const;  // contradictory values; empty: none
  std::string immovable();         // joint without inertia in every pose; empty: none. Uses the workspace
  double energy_offset = 0;        // the energy balance starts at 0

 private:
  void renew_plan();
  std::string apply_state();

  Simulation& simulation_;
  CurrentState& state_;
  const std::size_t size_;
  bool in_force_ = true, changed_ = false;
  bool inertia_tuned_ = false;  // since the plan was current
  Given given_ = Given::none;
};

}  // namespace redysim
