#pragma once

#include <string>
#include <vector>

#include "fmi/instance/current_state.hpp"

namespace redysim {

// The parameters of the model as the master has set them, and whether the plan contains them.
class ParameterSet {
 public:
  ParameterSet(Simulation& simulation, CurrentState& state);

  void reset();  // to the values of the model file
  std::size_t size() const { return start_values_.size(); }
  std::vector<double> values() const;
  void exchange(std::vector<double>& values, SolverMethod& method);  // with those of the model

  // Notes that a value of the model was set.
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
  std::vector<double> start_values_;  // of the Real parameters, in table order
  SolverMethod start_method_;
  bool in_force_ = true, changed_ = false;
  bool inertia_tuned_ = false;  // since the plan was current
};

}  // namespace redysim
