#pragma once

#include <memory>
#include <string>

#include "fmi/variables/variables.hpp"
#include "integrate/methods/integrator.hpp"
#include "integrate/system/independent_coordinates.hpp"
#include "integrate/system/system.hpp"
#include "model/model.hpp"

namespace redysim {

// Model, equations and integrator of one instance, shared by its parts.
struct Simulation {
  Simulation(Model given, bool for_model_exchange);
  // Integrates the system, or holds what the master integrates.
  std::unique_ptr<Integrator> make_integrator(const SolverSettings& settings);
  std::string failed_joint() const;  // cause of the last failure; empty: unknown
  // The states of a master of model exchange.
  IndependentCoordinates& independent();

  const Model model;
  const bool model_exchange;      // the master integrates: `integrator` is a GivenState
  Parameters<double> parameters;  // the current ones
  Plan<double> plan;
  System system;  // uses plan; holds the inputs
  const std::vector<int> independent_counts;
  VariableTable table;
  std::unique_ptr<Integrator> integrator;  // from the end of initialization on
  SolverSettings integrator_settings;      // that it was made with
  double time = 0;                         // of the last communication point

 private:
  std::unique_ptr<IndependentCoordinates> independent_;  // null before the first request
};

}  // namespace redysim
