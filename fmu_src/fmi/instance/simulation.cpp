#include "fmi/instance/simulation.hpp"

#include <utility>

namespace redysim {

Simulation::Simulation(Model given)
    : model(std::move(given)),
      parameters(parameters_of(model)),
      plan(model, parameters),
      table(model, plan),
      system(plan, has_work(model, plan), &model) {}

std::string Simulation::failed_joint() const {
  const int joint = system.failed_joint();
  if (joint < 0 || joint >= static_cast<int>(plan.joints.size())) return {};
  for (std::size_t ball = 0; ball < plan.balls.size(); ++ball)
    if (joint >= plan.balls[ball] && joint < plan.balls[ball] + 4) return model.balls[ball].name;
  return model.links[plan.joints[joint].link].joint.name;
}

}  // namespace redysim
