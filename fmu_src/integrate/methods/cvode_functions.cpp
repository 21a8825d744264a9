#include <cvode/cvode.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>

#include "integrate/methods/cvode.hpp"

// The functions that CVODE calls: slopes, error weights, Jacobians and projections.

namespace redysim {

using namespace sundials;

namespace {

// Each restart begins with order one. The first steps after changed inputs use a still tighter tolerance:
// otherwise the errors of one restart per millisecond add up to a hundred tolerances. The start of a run uses
// the normal one.
constexpr double restart_tightening = 0.1;
constexpr int restart_steps = 6;

}  // namespace

int Cvode::right_hand_side(double time, N_Vector y, N_Vector ydot, void* self_pointer) {
  Cvode& self = *static_cast<Cvode*>(self_pointer);
  if (self.warming_up_) {
    std::fill_n(data(ydot), self.y_.size(), 0.0);
    return 0;
  }
  if (self.slope_known_) {
    self.slope_known_ = false;
    std::copy(self.slope_.begin(), self.slope_.end(), data(ydot));
    return 0;
  }
  ++self.statistics_.evaluations;
  if (self.linear_solver_) newton_matrix(self.linear_solver_).set_present(data(y));
  return static_cast<int>(self.system_.right_hand_side(self.absolute(time), data(y), data(ydot)));
}

// CVODE requests the weights once before each step, at the newest entry of its history. CVODE's own
// projection supports BDF only. Therefore Adams' history is projected onto the loop constraints here: only
// the state entry, since the others are right-hand sides (coordinate projection; Eich 1993).
int Cvode::weights(N_Vector y, N_Vector weights, void* self_pointer) {
  Cvode& self = *static_cast<Cvode*>(self_pointer);
  if (self.project_history_ && self.steps_taken_ > 0) {
    const Status status = self.system_.project(self.absolute(self.ahead_time_), data(y), nullptr);
    self.projection_failed_ = status != Status::ok;
    if (self.projection_failed_) return -1;
  }
  const bool tightened = self.restart_.repeated && self.steps_taken_ < restart_steps;
  self.error_weights_.evaluate(data(y), data(weights), tightened ? restart_tightening : 1);
  return 0;
}

int Cvode::jacobian(double time, N_Vector y, N_Vector, SUNMatrix matrix, void* self_pointer, N_Vector,
                    N_Vector, N_Vector) {
  Cvode& self = *static_cast<Cvode*>(self_pointer);
  if (self.warming_up_) return SUNMatZero(matrix);
  ++self.statistics_.jacobians;
  ++self.statistics_.evaluations;
  newton_matrix(self.linear_solver_).set_reference(data(y));
  return static_cast<int>(self.jacobian_->evaluate(self.absolute(time), data(y), SM_DATA_D(matrix)));
}

int Cvode::project(double time, N_Vector y, N_Vector correction, double, N_Vector error, void* self_pointer) {
  Cvode& self = *static_cast<Cvode*>(self_pointer);
  N_VConst(0.0, correction);
  if (self.warming_up_) return 0;
  std::copy_n(data(y), self.y_.size(), data(correction));
  const Status status =
      self.system_.project(self.absolute(time), data(correction), error ? data(error) : nullptr);
  N_VLinearSum(1.0, correction, -1.0, y, correction);
  return static_cast<int>(status);
}

// Power of the drives within the last step. Does not change error_.
bool Cvode::power(double time, void* self_pointer, int part, double& power) {
  Cvode& self = *static_cast<Cvode*>(self_pointer);
  if (CVodeGetDky(self.memory_.get(), time, 0, self.weights_.get()) != CV_SUCCESS) return false;
  const Status status =
      self.system_.slope_within_step(self.absolute(time), data(self.weights_), self.slope_.data());
  power = self.system_.layout().work.of(self.slope_.data())[part];
  return status == Status::ok;
}

}  // namespace redysim
