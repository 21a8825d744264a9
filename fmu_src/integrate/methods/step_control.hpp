#pragma once

namespace redysim {

// Maximum step size, s, set by SolverSettings::max_step (0: unlimited). Its reciprocal is finite.
double step_limit(double max_step);

// Step-size control of a one-step method: a PI controller (Gustafsson 1991; Hairer, Wanner II, IV.2). Steps
// shortened by a communication point do not disturb it.
class StepControl {
 public:
  // `error_order`: the local error is proportional to h^error_order.
  StepControl(int error_order, double max_step);
  void set_error_order(int error_order);

  void start(double step) {
    wanted_ = limited(step);
    previous_error_ = 1;
  }
  void forget_errors() { previous_error_ = 1; }  // call after a change of the right-hand side

  // Update after a step of size h with this weighted error.
  void accepted(double h, double error);
  // The step size to try next; an error that is not finite: the right-hand side failed.
  double rejected(double h, double error);
  void limit(double h) { wanted_ = h < wanted_ ? h : wanted_; }

  // Next step size for the `remaining` time, s: equal parts instead of a small remainder at the end.
  double step_for(double remaining) const;
  static double parts_of(double remaining, double step);  // number of steps

  double limited(double step) const { return step < step_limit_ ? step : step_limit_; }

  double step_limit() const { return step_limit_; }
  double wanted() const { return wanted_; }
  double previous_error() const { return previous_error_; }
  void restore(double wanted, double previous_error) {
    wanted_ = wanted;
    previous_error_ = previous_error;
  }

 private:
  double integral_, proportional_, plain_, safety_, step_limit_;
  double wanted_ = 0;          // s, allowed by the tolerance, independent of the communication step
  double previous_error_ = 1;  // of the last accepted step
};

}  // namespace redysim
