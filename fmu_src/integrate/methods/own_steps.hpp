#pragma once

#include "integrate/methods/one_step.hpp"

namespace redysim {

// Base of the one-step methods that take their steps themselves instead of ARKODE.
class OwnSteps : public OneStep {
 protected:
  OwnSteps(System& system, const SolverSettings& settings, Room room, SolverMethod method, int error_order,
           double tightening);

  int run(double h) override;
  double reached() const override { return reached_; }
  const double* last_slope() const override { return nullptr; }
  const char* reason(int) const override { return nullptr; }

  // A step from reached_ and y(), before its first attempt, which is one of h. False: it has no slope.
  virtual bool begin_step(double h) = 0;
  // Leaves the end of a step of h in candidate_. Returns its weighted error, infinite: it is impossible.
  virtual double attempt_error(double h) = 0;
  // Goes to candidate_ at `end`. Returns a flag of ARKODE.
  virtual int accept(double end, double h);

  double* y() { return sundials::data(result_); }

  double reached_ = 0;          // time of y(), since origin_
  sundials::Vector candidate_;  // end of the last attempt

 private:
  int take_step(double& h);
};

}  // namespace redysim
