#pragma once

namespace redysim {

// The step size of a one-step method: a PI controller (Gustafsson 1991; Hairer, Wanner II, IV.2) that
// survives steps cut short by a communication point.
class StepControl {
 public:
  // `error_order`: the local error is proportional to h^error_order.
  StepControl(int error_order, double max_step);
  void set_error_order(int error_order);

  void start(double step) {
    wanted_ = limited(step);
    previous_error_ = 1;
  }
  void forget_errors() { previous_error_ = 1; }  // the equation changed

  // A step of size h had the weighted error (not a number: the right-hand side failed).
  void accepted(double h, double error);
  double rejected(double h, double error);  // the step to try instead
  void limit(double h) { wanted_ = h < wanted_ ? h : wanted_; }

  // The step to take when `remaining` is left: equal parts rather than a small rest at the end.
  double step_for(double remaining) const;
  static double parts_of(double remaining, double step);  // how many

  double limited(double step) const { return step < max_step_ ? step : max_step_; }

  double wanted() const { return wanted_; }
  double previous_error() const { return previous_error_; }
  void restore(double wanted, double previous_error) {
    wanted_ = wanted;
    previous_error_ = previous_error;
  }

 private:
  double integral_, proportional_, plain_, max_step_;
  double wanted_ = 0;          // s, what the tolerance allows, whatever the communication step
  double previous_error_ = 1;  // of the last accepted step
};

}  // namespace redysim
