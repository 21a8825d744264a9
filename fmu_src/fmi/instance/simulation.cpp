#include "fmi/instance/simulation.hpp"

#include <utility>

#include "integrate/methods/given_state.hpp"

namespace redysim {

Simulation::Simulation(Model given, bool for_model_exchange)
    : model(std::move(given)),
      model_exchange(for_model_exchange),
      parameters(parameters_of(model)),
      plan(model, parameters),
      table(model, plan),
      system(plan, has_work(model, plan), &model) {}

std::unique_ptr<Integrator> Simulation::make_integrator(const SolverSettings& settings) {
  if (model_exchange) return std::make_unique<GivenState>(system);
  return redysim::make_integrator(system, settings);
}

std::string Simulation::failed_joint() const {
  const int joint = system.failed_joint();
  if (joint < 0 || joint >= static_cast<int>(plan.joints.size())) return {};
  for (std::size_t ball = 0; ball < plan.balls.size(); ++ball)
    if (joint >= plan.balls[ball] && joint < plan.balls[ball] + 4) return model.balls[ball].name;
  return model.links[plan.joints[joint].link].joint.name;
}

}  // namespace redysim
