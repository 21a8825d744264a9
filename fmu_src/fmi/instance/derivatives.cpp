#include "fmi/instance/derivatives.hpp"

#include <cmath>

#include "dynamics/ball.hpp"
#include "fmi/variables/entry.hpp"
#include "model/number.hpp"

namespace redysim {

std::string OutputDerivatives::objection(const Variable& known, double direction,
                                         bool in_initialization) const {
  if (!std::isfinite(direction))
    return "the direction of " + known.name + " must be a finite number, got " + shown(direction);
  if (known.is_calculated()) {
    if (values_.exchanged_place(known) < 0)
      return known.name + " is neither an input nor a state, not a known";
    return in_initialization ? "derivatives by " + known.name + ", a state, exist after initialization only"
                             : std::string();
  }
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
  jumps_ = moves_state_ = false;
  work_change_[0] = work_change_[1] = 0;
  independent_.clear();
  return {};
}

void OutputDerivatives::set_direction(const Variable& known, double direction) {
  if (known.is_calculated()) return change_state(known, direction);
  Tangent& at = *tangent_;
  const auto add = [direction](Dual& number) { number.derivative += direction; };
  switch (known.row->storage) {
    case Storage::none:
      break;
    case Storage::parameter:
      add(*known.group->dual_place(known.row_index(), at.parameters, known));
      break;
    case Storage::input:
      add(at.force[known.group->input(known.row_index(), simulation_.system, known)]);
      break;
    case Storage::motion:
      std::vector<Dual>* const of_order[] = {&at.q, &at.qd, &at.force};
      add((*of_order[known.row->motion_order])[known.joint]);
      break;
  }
  jumps_ = jumps_ || (known.row->acts & (acts::position | acts::velocity)) != 0;
}

void OutputDerivatives::change_state(const Variable& known, double direction) {
  Tangent& at = *tangent_;
  moves_state_ = true;
  switch (known.row->state) {
    case StatePart::q:
      at.q[known.joint].derivative += direction;
      break;
    case StatePart::qd:
      at.qd[known.joint].derivative += direction;
      break;
    case StatePart::quaternion:
      at.balls[known.ball].quaternion[known.element] += direction;
      break;
    case StatePart::omega:
      at.balls[known.ball].omega[known.element] += direction;
      break;
    case StatePart::independent_q:
    case StatePart::independent_qd: {
      const std::size_t count = static_cast<std::size_t>(simulation_.independent().count());
      independent_.resize(2 * count);
      independent_[(known.row->state == StatePart::independent_q ? 0 : count) +
                   static_cast<std::size_t>(known.element)] += direction;
      break;
    }
    case StatePart::work:
      work_change_[0] += direction;
      break;
    case StatePart::contact_work:
      work_change_[1] += direction;
      break;
    default:
      at.state(values_.place(known)).derivative += direction;
  }
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
  if (!simulation_.model_exchange)
    if (const std::string why = follow_jumps(); !why.empty()) return why;
  follow_independent();
  work_ = jumps_ && !simulation_.model_exchange ? Work::of_energy : Work::given;
  return {};
}

// Joints in loops and rigid couplings follow the independent ones; in model exchange also prescribed motions.
void OutputDerivatives::follow_independent() {
  const bool by_motion = simulation_.model_exchange && jumps_ && simulation_.system.has_constraints();
  if (independent_.empty() && !by_motion) return;
  const IndependentCoordinates& states = state_.independent();
  independent_.resize(2 * static_cast<std::size_t>(states.count()));
  tangent_->follow_independent(simulation_.model, simulation_.system, simulation_.time, state_.y(), states,
                               independent_.data(), independent_.data() + states.count());
}

// At a communication point, changed prescribed motions jump.
std::string OutputDerivatives::follow_jumps() {
  if (!jumps_) return {};
  if (moves_state_)
    return "at a communication point a state and a prescribed motion cannot change in one direction: request "
           "each "
           "alone";
  if (!state_.follows_motion() && !state_.can_follow())
    return "there are no derivatives: the joints cannot follow the prescribed motion";
  if (simulation_.integrator)
    tangent_->follow_jumps(simulation_.system, simulation_.time, simulation_.integrator->state());
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
    case Work::given:
      return work_change_[0];
  }
  return 0;
}

double OutputDerivatives::contact_work() {
  if (work_ == Work::given) return work_change_[1];
  return work_ == Work::by_power ? tangent().contact_power().value : 0;
}

double OutputDerivatives::balance() { return work_ == Work::none ? 0 : energy() - work(); }

double quaternion_change(Eigen::Vector4d quaternion, const Vec3<double>& turn, int component) {
  double rate[4];
  quaternion.normalize();
  quaternion_rate(quaternion.data(), turn.data(), rate);
  return rate[component];
}

}  // namespace redysim
