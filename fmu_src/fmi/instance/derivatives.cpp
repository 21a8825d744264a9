#include "fmi/instance/derivatives.hpp"

#include <cmath>

#include "dynamics/ball.hpp"
#include "fmi/variables/entry.hpp"
#include "model/read/number.hpp"

namespace redysim {

OutputDerivatives::OutputDerivatives(Simulation& simulation, CurrentState& state, Values& values)
    : simulation_(simulation), state_(state), values_(values) {}

std::string OutputDerivatives::objection(const Variable& known, double direction, bool in_initialization) {
  if (!std::isfinite(direction))
    return "the direction of " + known.name + " must be a finite number, got " + shown(direction);
  if (known.causality() == Causality::output) return known.name + " is an output, not a known";
  if (!known.row->has_direction) return "no derivatives exist with respect to " + known.name;
  if (known.causality() == Causality::parameter && !in_initialization)
    return "derivatives by " + known.name + " exist in initialization mode only";
  return {};
}

std::string OutputDerivatives::begin() {
  std::string why = values_.update(Needs::accelerations);
  if (!why.empty()) return why;
  if (!tangent_) tangent_ = std::make_unique<Tangent>(simulation_.model, simulation_.system);
  tangent_->go_to(simulation_.parameters, simulation_.system, simulation_.time, state_.y());
  jumps_ = false;
  return {};
}

void OutputDerivatives::set_direction(const Variable& known, double direction) {
  Tangent& at = *tangent_;
  const auto add = [direction](Dual& number) { number.derivative += direction; };
  switch (known.row->storage) {
    case Storage::none:
      break;
    case Storage::parameter:
      add(*known.group->dual_place(known.row_index, at.parameters, known));
      break;
    case Storage::input:
      add(at.force[known.group->input(known.row_index, simulation_.system, known)]);
      break;
    case Storage::motion:
      std::vector<Dual>* const of_order[] = {&at.q, &at.qd, &at.force};
      add((*of_order[known.row->motion_order])[known.joint]);
      break;
  }
  jumps_ = jumps_ || (known.row->acts & (acts::position | acts::velocity)) != 0;
}

std::string OutputDerivatives::follow(bool in_initialization) {
  tangent_->apply_parameters();
  if (in_initialization) {
    const char* why = simulation_.system.has_constraints()
                          ? tangent_->follow_assembly(simulation_.model, state_.how_started().assembly)
                          : nullptr;
    if (why) return "there are no derivatives along this direction: " + std::string(why);
    tangent_->start_actuators();
    work_ = Work::none;
    return {};
  }
  if (jumps_ && !state_.follows_motion() && !state_.can_follow())
    return "there are no derivatives: the joints cannot follow the prescribed motion";
  if (jumps_ && simulation_.integrator)
    tangent_->follow_jumps(simulation_.system, simulation_.time, simulation_.integrator->state());
  work_ = Work::of_energy;
  return {};
}

std::string OutputDerivatives::go_with_time() {
  std::string why = begin();
  if (!why.empty()) return why;
  tangent_->go_with_time(simulation_.system, simulation_.time, state_.y());
  work_ = Work::by_power;
  return {};
}

std::string OutputDerivatives::evaluate() {
  return tangent_->evaluate() ? std::string() : "the derivatives are not finite";
}

double OutputDerivatives::work() {
  switch (work_) {
    case Work::none:
      return 0;
    case Work::of_energy:
      return energy();
    case Work::by_power:
      return tangent().power.value;
  }
  return 0;
}

double OutputDerivatives::balance() { return work_ == Work::none ? 0 : energy() - work(); }

double quaternion_change(Eigen::Vector4d quaternion, const Vec3<double>& turn, int component) {
  double rate[4];
  quaternion.normalize();
  quaternion_rate(quaternion.data(), turn.data(), rate);
  return rate[component];
}

}  // namespace redysim
