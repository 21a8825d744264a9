#include "integrate/methods/own_steps.hpp"

#include <arkode/arkode.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace redysim {

using namespace sundials;

OwnSteps::OwnSteps(System& system, const SolverSettings& settings, Room room, SolverMethod method,
                   int error_order, double tightening)
    : OneStep(system, settings, std::move(room), method, error_order, tightening),
      candidate_(make_vector(system.size(), room_->context)) {}

int OwnSteps::run(double h) {
  reached_ = since_;
  std::copy_n(data(start_), y_.size(), y());
  int flag = ARK_SUCCESS;
  for (long taken = 0; flag == ARK_SUCCESS && reached_ < end_; ++taken)
    flag = taken < allowed_ ? take_step(h) : ARK_TOO_MUCH_WORK;
  slope_known_ = false;
  return flag;
}

// `h`: of the first attempt, then of the next step.
int OwnSteps::take_step(double& h) {
  if (!begin_step(h)) return ARK_RHSFUNC_FAIL;
  double end = 0, error = 0, taken = 0;
  do {
    const double left = end_ - reached_, beyond = h - left, rounding = smallest_step(reached_, end_);
    if (beyond > -rounding && (!may_pass_end_ || beyond < rounding)) h = left;
    end = h == left ? end_ : reached_ + h;
    taken = h;
    error = attempt_error(h);
    double next = 0;
    if (adapt(candidate_.get(), end, h, 0, 0, error, 0, 0, 0, 0, &next, this) != 0) return ARK_ERR_FAILURE;
    h = next * sundials_safety;
  } while (!(error <= 1));
  return accept(end, taken);
}

int OwnSteps::accept(double end, double) {
  if (complete_step(end, candidate_.get(), this) != 0) return ARK_POSTPROCESS_STEP_FAIL;
  reached_ = end;
  std::copy_n(data(candidate_), y_.size(), y());
  slope_known_ = false;
  return ARK_SUCCESS;
}

}  // namespace redysim
