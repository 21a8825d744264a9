#include "model/parameters.hpp"

#include <utility>

namespace redysim {
namespace {

// The spherical joint that contains the joint of this link; null if there is none.
const Ball* ball_of(const Model& model, std::size_t link) {
  const int at = static_cast<int>(link);
  for (const Ball& ball : model.balls)
    if (ball.chart_link <= at && at < ball.chart_link + 4) return &ball;
  return nullptr;
}

void append(std::vector<double>& to, const double* numbers, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) to.push_back(numbers[k]);
}

void add_actuators(const Model& model, std::vector<double>& states) {
  std::vector<double> positions, velocities, others;
  for (const Actuator& actuator : model.actuators) {
    const Joint& joint = model.links[actuator.link].joint;
    if (!actuator.acts() || is_prescribed(joint)) continue;
    if (actuator.is_elastic()) {
      positions.push_back(actuator.gear_ratio * joint.q0);
      velocities.push_back(actuator.gear_ratio * joint.qd0);
    }
    others.resize(others.size() + actuator.has_inductance() + actuator.lags());
  }
  for (const auto* part : {&positions, &velocities, &others}) append(states, part->data(), part->size());
}

StateToApply start_state(const Model& model) {
  StateToApply state;
  if (!model.fmu.shows(OutputGroup::state)) return state;
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    const Joint& joint = model.links[i].joint;
    if (const Ball* ball = ball_of(model, i)) {
      if (ball->chart_link != static_cast<int>(i)) continue;
      append(state.q, ball->quaternion.data(), ball->quaternion.size());
      append(state.qd, ball->omega.data(), ball->omega.size());
    } else if (moves(joint)) {
      state.q.push_back(joint.q0);
      state.qd.push_back(joint.qd0);
    }
  }
  add_actuators(model, state.actuator);
  return state;
}

}  // namespace

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
          model.solver,
          start_state(model)};
}

}  // namespace redysim
