#pragma once

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
  void stepped() { changed_ = false; }

  bool in_force() const { return in_force_; }
  // Applies the values to the plan. Returns why they are contradictory or leave a joint without inertia,
  // empty on success.
  std::string bring_into_force();
  // The same if the values are consistent. The energy balance keeps its value: tuning is not an energy error.
  void bring_into_force_if_possible();
  void restored(bool changed);

  std::string impossible() const;  // contradictory values; empty: none
  std::string immovable();         // joint without inertia in every pose; empty: none. Uses the workspace
  double energy_offset = 0;        // the energy balance starts at 0

 private:
  void renew_plan();

  Simulation& simulation_;
  CurrentState& state_;
  const std::size_t size_;
  bool in_force_ = true, changed_ = false;
  bool inertia_tuned_ = false;  // since the plan was current
};

}  // namespace redysim
