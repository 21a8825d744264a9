#include "fmi/instance/values.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/compiled.hpp"
#include "dynamics/momentum.hpp"
#include "fmi/variables/parameters.hpp"
#include "model/number.hpp"

namespace redysim {

Values::Values(Simulation& simulation, CurrentState& state, ParameterSet& parameters,
               PrescribedMotion& motion)
    : simulation_(simulation),
      state_(state),
      parameters_(parameters),
      motion_(motion),
      accelerations_(static_cast<std::size_t>(simulation.plan.nv)),
      drive_forces_(accelerations_),
      ball_accelerations_(simulation.plan.balls.size()),
      q_(simulation.plan.has_motion() ? accelerations_.size() : 0),
      qd_(q_) {
  if (SensedWrenches<double>::needed(simulation.model))
    sensed_ = std::make_unique<SensedWrenches<double>>(simulation.model, simulation.plan);
  if (EquationTerms<double>::needed(simulation.model))
    terms_ = std::make_unique<EquationTerms<double>>(simulation.model, simulation.plan);
  if (StepJacobian::needed(simulation.model)) step_jacobian_ = std::make_unique<StepJacobian>(simulation);
}

std::string Values::update(Needs needs) {
  if (are_current(needs)) return {};
  coordinates_are_current_ = bodies_are_moved_ = false;  // parameters may replace the state
  if (needs >= Needs::step_jacobian) return step_jacobian_->update(needs == Needs::step_jacobian_by_knowns);
  std::string why = parameters_.bring_into_force();
  if (!why.empty() || needs <= Needs::parameters) return why;
  if (simulation_.model_exchange && state_.y() && !state_.can_follow())
    return "the loop constraints cannot be satisfied at " + shown(simulation_.time) + " s";
  if (needs == Needs::accelerations) return update_accelerations();
  if (needs == Needs::slopes) return update_slopes();
  kinetic_energy_ = system().kinetic_energy(simulation_.time, state_.y());
  potential_energy_ = system().potential_energy(simulation_.time, state_.y());
  energies_are_current_ = true;
  return {};
}

std::string Values::update_accelerations() {
  const double time = simulation_.time;
  body_.index = contact_.index = none;
  bool finite = system().accelerations(time, state_.y(), accelerations_.data()) == Status::ok;
  for (double value : accelerations_) finite = finite && std::isfinite(value);
  if (!finite) return not_finite();
  if (has_drive_forces()) system().drive_forces(coordinates(), accelerations_.data(), drive_forces_.data());
  for (int ball = 0; ball < system().balls(); ++ball)
    ball_accelerations_[ball] = system().ball_acceleration(ball, accelerations_.data());
  if (sensed_) update_sensed_wrenches();
  if (terms_) {
    const System::Coordinates at = coordinates();
    terms_->go_to(at.q, at.qd, accelerations_.data(), system().recursion_port_wrenches(),
                  system().workspace().loop.lambda);
  }
  accelerations_are_current_ = true;
  return {};
}

std::string Values::update_slopes() {
  slopes_.resize(static_cast<std::size_t>(system().size()));
  if (system().slope_within_step(simulation_.time, state_.y(), slopes_.data()) != Status::ok)
    return not_finite();
  slopes_are_current_ = true;
  return {};
}

std::string Values::not_finite() const {
  const std::string joint = simulation_.failed_joint();
  return "the accelerations at " + shown(simulation_.time) + " s are not finite" +
         (joint.empty() ? "" : " (joint '" + joint + "')");
}

void Values::update_sensed_wrenches() {
  const System::Coordinates at = coordinates();
  sensed_->update(simulation_.parameters);
  sensed_->evaluate(at.q, at.qd, accelerations_.data(), system().recursion_port_wrenches(),
                    system().workspace().loop.lambda);
}

void Values::update_coordinates() {
  coordinates_ = system().coordinates(simulation_.time, state_.y());
  coordinates_are_current_ = true;
  if (!plan().has_motion()) return;
  // other evaluations overwrite the system's arrays
  std::copy_n(coordinates_.q, q_.size(), q_.begin());
  std::copy_n(coordinates_.qd, q_.size(), qd_.begin());
  coordinates_ = {q_.data(), qd_.data()};
}

const Workspace<double>& Values::moved_bodies() {
  if (!bodies_are_moved_) {
    const System::Coordinates at = coordinates();
    compiled_ground_motion(plan(), system().workspace(), at.q, at.qd);
    bodies_are_moved_ = true;
  }
  return system().workspace();
}

Force<double> Values::momentum() {
  bodies_are_moved_ = false;
  const System::Coordinates at = coordinates();
  return redysim::momentum(plan(), system().workspace(), at.q, at.qd);
}

const AcceleratedBody<double>& Values::body(int index) {
  if (body_.index != index) {
    body_.value = body_motion(plan(), moved_bodies(), index, coordinates().qd, accelerations_.data());
    body_.index = index;
  }
  return body_.value;
}

const ContactResult<double>& Values::contact(int index) {
  if (contact_.index != index) {
    contact_.value = contact_result(plan(), moved_bodies(), index, model().contacts[index].a.link);
    contact_.index = index;
  }
  return contact_.value;
}

double Values::margin() {
  const double* y = state_.y();
  if (!state_.can_follow()) return -1;  // a singular configuration is on the path to the states
  constexpr double limit = IndependentCoordinates::event;
  return 2 * limit / (limit + state_.independent().leverage(simulation_.time, y)) - 1;
}

double Values::energy_balance() {
  if (!simulation_.integrator) return 0;
  return kinetic_energy_ + potential_energy_ - work() - parameters_.energy_offset;
}

double Values::read_known(const Variable& variable) {
  switch (variable.row->storage) {
    case Storage::none:
      break;
    case Storage::parameter:
      return *parameter(simulation_.parameters, variable);
    case Storage::input:
      return system().inputs()[variable.group->input(variable.row_index(), system(), variable)];
    case Storage::motion:
      return motion_.value(variable.joint, variable.row->motion_order);
  }
  return 0;
}

double Values::read_rate(const Variable& variable) {
  return variable.group->read(variable.row_index() + 1, *this, variable);
}

}  // namespace redysim
