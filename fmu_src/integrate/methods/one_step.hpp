#pragma once

#include "integrate/methods/first_step.hpp"
#include "integrate/methods/methods.hpp"
#include "integrate/methods/step_control.hpp"
#include "integrate/methods/sundials_objects.hpp"

// What the Runge-Kutta methods of SUNDIALS' ARKODE share, explicit and implicit.
//
// Each advance is a fresh start of ARKODE at (time, y) with a stop time, so that nothing but y, the step
// control and the slope at the start, where it is known, lives on. ARKODE counts time from the begin of the
// advance, so that its steps may be shorter than the rounding of a large time.

namespace redysim {

class StateReader;
class StateWriter;

class OneStep : public Integrator {
 public:
  Outcome start(double time, const double* y) override;
  Outcome advance(double end, bool inputs_changed) override;

  double time() const override { return origin_ + since_; }
  const double* state() const override { return y_.data(); }
  const Statistics& statistics() const override { return statistics_; }

  SolverMethod method() const override { return method_; }
  // By the tolerance, s; 0: unknown. Where a method has several tables, that of the lower order.
  virtual double allowed_step() const { return fresh_ ? 0 : control_.wanted(); }
  // The step times a spectral radius, as a part of what an explicit method can bear.
  double stability_used(double radius) const { return fresh_ ? 0 : control_.wanted() * radius / stability(); }
  void expect_step(double step);  // after `start`

  void save(std::vector<unsigned char>& bytes) const override;
  bool restore(const unsigned char* bytes, std::size_t size) override;

 protected:
  // `error_order`: the error estimate is proportional to h^error_order. `tightening`: what a step may err, of
  // the user's tolerance.
  OneStep(System& system, const SolverSettings& settings, SolverMethod method, int error_order,
          double tightening);

  // One run of ARKODE from (since_, y_) to end_ into result_ in at most allowed_ steps; its flag.
  virtual int run(double first_step) = 0;
  virtual double reached() const = 0;              // by the last run, when it failed; since origin_
  virtual const double* last_slope() const = 0;    // f at the end of the last run, or null
  virtual const char* reason(int flag) const = 0;  // of a failure that only the method knows, or null
  virtual double stability() const { return 1; }   // its interval on the negative real axis, if it is finite
  virtual long unsolved() const { return 0; }      // attempts of all runs whose stages were not solved

  // A method of several tables: which serves the rest of an advance, looked at again every so many steps (0:
  // never). What it decides by is part of a saved state.
  virtual void choose_table(double /*remaining*/) {}
  virtual long steps_between_choices() const { return 0; }
  virtual void forget_choice() {}
  virtual void put_choice(StateWriter&) const {}
  virtual bool get_choice(StateReader& reader);  // must finish it; false: unchanged
  void set_error_order(int error_order) {
    error_order_ = error_order;
    control_.set_error_order(error_order);
  }

  // What ARKODE's time is for the system.
  double absolute(double since) const { return since == end_ ? goal_ : origin_ + since; }

  // Signs of ARKODE; `self` is a OneStep.
  static int weights(N_Vector y, N_Vector weights, void* self);
  static int adapt(N_Vector y, double t, double h, double, double, double error, double, double, int, int,
                   double* next, void* self);
  static int complete_step(double time, N_Vector y, void* self);
  static constexpr double sundials_safety = 0.96;  // ARKODE multiplies what `adapt` proposes

  System& system_;
  SolverSettings settings_;
  ErrorWeights error_weights_;
  StepControl control_;
  sundials::Context context_;
  sundials::LastMessage message_;
  sundials::Vector start_, result_;

  // what the future depends on
  double origin_ = 0;  // end of the last advance that was not cut short
  double since_ = 0;   // then
  std::vector<double> y_;
  std::vector<double> slope_;  // f(time(), y_) of the last inputs, when slope_known_
  bool slope_known_ = false;
  Statistics statistics_;

  // of the advance under way
  std::vector<double> y_before_;  // where it began
  double goal_ = 0;               // its end
  double end_ = 0;                // the same since origin_
  long allowed_ = 0;              // steps of this run
  bool warming_up_ = false;       // ARKODE allocates in its first step: it takes one of a system at rest
  bool stage_failed_ = false;     // a stage had no slope: this attempt is to be rejected
  bool skip_slope_ = false;       // the next slope asked for is not used: the advance is over

 private:
  bool first_step_from_here();
  int attempt();
  int attempt_until_closed();
  void arrive(double since);
  Outcome explain(int flag, long allowed);

  SolverMethod method_;
  int error_order_;
  FirstStepRoom room_;
  double largest_step_;
  bool fresh_ = true;  // the step size is to be found
  long unsolved_before_ = 0;
  bool step_at_floor_ = false;
  bool projection_failed_ = false;
};

}  // namespace redysim
