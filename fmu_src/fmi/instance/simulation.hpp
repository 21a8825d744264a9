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
  // Integrates the system; in model exchange, holds the states that the master integrates.
  std::unique_ptr<Integrator> make_integrator(const SolverSettings& settings);
  std::string failed_joint() const;  // cause of the last failure; empty: unknown
  // The states of model exchange.
  IndependentCoordinates& independent();

  const Model model;
  const bool model_exchange;      // the master integrates: `integrator` is a GivenState
  Parameters<double> parameters;  // current values
  Plan<double> plan;
  System system;  // uses plan; holds the inputs
  const std::vector<int> independent_counts;
  VariableTable table;
  std::unique_ptr<Integrator> integrator;  // null before the end of initialization
  SolverSettings integrator_settings;      // settings of `integrator`
  double time = 0;                         // time of the last communication point, s

 private:
  std::unique_ptr<IndependentCoordinates> independent_;  // null before the first request
};

}  // namespace redysim
