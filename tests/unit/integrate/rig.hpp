#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "integrate/methods/integrator.hpp"
#include "integrate/system/start.hpp"
#include "model/read/model_file.hpp"
#include "model/solver_methods.hpp"

namespace redysim::test {

// For suites that run over all methods.
inline auto every_method() {
  return testing::Values(SolverMethod::erk, SolverMethod::adams, SolverMethod::dirk, SolverMethod::bdf,
                         SolverMethod::exponential, SolverMethod::automatic);
}
inline std::string method_name(const testing::TestParamInfo<SolverMethod>& method) {
  return redysim::method_name(method.param);
}

// A model of models/ with one integrator over it, started at its start pose.
struct Rig {
  Model model;
  Plan<double> plan;
  System system;
  std::unique_ptr<Integrator> integrator;

  Rig(const std::string& name, const SolverSettings& settings, bool with_work = false)
      : model(read_model_file(std::string(REDYSIM_MODELS "/") + name + ".toml").model),
        plan(model),
        system(plan, with_work, &model),
        integrator(make_integrator(system, settings)) {
    const std::vector<double> y = start_state();
    integrator->start(0, y.data());
  }
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  std::vector<double> start_state() const {
    std::vector<double> y(static_cast<std::size_t>(system.size()), 0.0);
    set_start_values(parameters_of(model), system, y.data());
    return y;
  }
  std::vector<double> state() const { return {integrator->state(), integrator->state() + system.size()}; }
};

inline SolverSettings solver(SolverMethod method, double rtol, double atol) {
  SolverSettings settings;
  settings.method = method;
  settings.rtol = rtol;
  settings.atol = atol;
  return settings;
}
inline SolverSettings solver(SolverMethod method, double rtol = 1e-6) {
  return solver(method, rtol, 1e-2 * rtol);
}

inline double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::fabs(a[i] - b[i]));
  return largest;
}

// Order of a method in the double pendulum, from errors and steps at two tolerances.
inline double observed_order(SolverMethod method, double loose, double tight) {
  Rig exact("double_pendulum", solver(SolverMethod::erk, 1e-12));
  EXPECT_TRUE(exact.integrator->advance(1, true).ok);
  double error[2], steps[2];
  for (int k : {0, 1}) {
    Rig rig("double_pendulum", solver(method, k == 0 ? loose : tight));
    EXPECT_TRUE(rig.integrator->advance(1, true).ok);
    error[k] = largest_difference(rig.state(), exact.state());
    steps[k] = static_cast<double>(rig.integrator->statistics().steps);
  }
  return std::log(error[0] / error[1]) / std::log(steps[1] / steps[0]);
}

}  // namespace redysim::test
