#pragma once

#include <vector>

#include "fmi/instance/simulation.hpp"
#include "integrate/system/start.hpp"

namespace redysim {

// The state y at the last communication point: before the first step the assembled start, then the state of
// the integrator. If a prescribed motion has jumped since the last step, y follows the jump as at the
// beginning of the next step. In model exchange with loops, y follows from the independent coordinates.
class CurrentState {
 public:
  explicit CurrentState(Simulation& simulation);

  const double* y() {
    if (simulation_.integrator && follows_motion_) return simulation_.integrator->state();
    return simulation_.integrator ? follow_motion() : start();
  }
  // The y from which the next step starts, before it follows a jump.
  const double* before_jumps() {
    return simulation_.integrator && !simulation_.model_exchange ? simulation_.integrator->state() : y();
  }
  // Chosen at the last event of model exchange; in co-simulation, for the present y.
  IndependentCoordinates& independent();
  const Start& how_started() const { return how_started_; }

  bool follows_motion() const { return follows_motion_; }  // false: a motion changed since the last step
  bool can_follow() const { return can_follow_; }          // false: the next step will fail

  void start_changed() { start_is_current_ = false; }
  void plan_changed() { following_is_current_ = false; }
  void motion_changed();
  void stepped() { follows_motion_ = true; }
  void given();  // model exchange: the master has set states
  // Replaces y by the nearest state that satisfies the loop constraints; a pending jump of prescribed joints
  // does not move it. False: they cannot be satisfied, nothing is changed.
  bool replace(double* y);
  void restored(bool follows_motion);
  void reset() { restored(true); }

 private:
  const double* start();
  const double* follow_motion();

  Simulation& simulation_;
  std::vector<double> start_, following_;
  Start how_started_;
  bool start_is_current_ = false, following_is_current_ = false;
  bool follows_motion_ = true, can_follow_ = true;
};

}  // namespace redysim
