#include "fmi/instance/simulation.hpp"

#include <utility>

#include "integrate/methods/given_state.hpp"

namespace redysim {

Simulation::Simulation(Model given, bool for_model_exchange)
    : model(std::move(given)),
      model_exchange(for_model_exchange),
      parameters(parameters_of(model)),
      plan(model, parameters),
      system(plan, has_work(model, plan), &model),
      independent_counts(independent_joints(model, parameters, system)),
      table(model, plan, independent_counts) {}

IndependentCoordinates& Simulation::independent() {
  if (!independent_)
    independent_ = std::make_unique<IndependentCoordinates>(model, system, independent_counts);
  return *independent_;
}

std::unique_ptr<Integrator> Simulation::make_integrator(const SolverSettings& settings) {
  if (model_exchange) return std::make_unique<GivenState>(system, independent());
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
