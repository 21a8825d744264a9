#include "fmi/instance/current_state.hpp"

#include <algorithm>

#include "integrate/methods/given_state.hpp"
#include "integrate/system/nearest.hpp"

namespace redysim {

CurrentState::CurrentState(Simulation& simulation)
    : simulation_(simulation), start_(simulation.system.size(), 0.0), following_(start_) {}

const double* CurrentState::start() {
  if (!start_is_current_) {
    how_started_ = assemble_start(simulation_.model, simulation_.parameters, simulation_.system,
                                  simulation_.time, start_.data());
    start_is_current_ = true;
  }
  return start_.data();
}

const double* CurrentState::follow_motion() {
  if (!following_is_current_) {
    std::copy_n(simulation_.integrator->state(), following_.size(), following_.begin());
    can_follow_ =
        simulation_.model_exchange
            ? static_cast<GivenState&>(*simulation_.integrator).close(simulation_.time, following_.data())
            : simulation_.system.follow_jumps(simulation_.time, following_.data());
    following_is_current_ = true;
  }
  return following_.data();
}

IndependentCoordinates& CurrentState::independent() {
  IndependentCoordinates& states = simulation_.independent();
  if (!simulation_.model_exchange || !simulation_.integrator) states.choose(simulation_.time, y());
  return states;
}

bool CurrentState::replace(double* y) {
  normalise_quaternions(simulation_.system.layout(), y);
  if (!close_loops_nearest(simulation_.system, simulation_.time, y)) return false;
  simulation_.system.forget_jumps();
  simulation_.integrator->set_state(y);
  follows_motion_ = true;
  if (simulation_.model_exchange) given();
  return true;
}

void CurrentState::given() {
  follows_motion_ = !simulation_.system.has_constraints();
  following_is_current_ = false;
}

void CurrentState::motion_changed() {
  follows_motion_ = !simulation_.integrator || simulation_.system.size() == 0;
  following_is_current_ = false;
  if (simulation_.model_exchange && simulation_.integrator) given();
  if (simulation_.system.has_constraints() || simulation_.model.starts_in_equilibrium) start_changed();
}

void CurrentState::restored(bool follows_motion) {
  start_is_current_ = following_is_current_ = false;
  can_follow_ = true;
  follows_motion_ = follows_motion;
}

}  // namespace redysim
