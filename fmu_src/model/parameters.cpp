#include "model/parameters.hpp"

#include <utility>

namespace redysim {

Parameters<double> parameters_of(const Model& model) {
  std::vector<JointParameters<double>> joints;
  for (const Link& link : model.links) joints.push_back(link.joint);
  return {model.gravity,
          {model.links.begin(), model.links.end()},
          std::move(joints),
          model.controller.joints,
          {model.balls.begin(), model.balls.end()},
          {model.contacts.begin(), model.contacts.end()},
          model.actuators,
          model.solver};
}

}  // namespace redysim
