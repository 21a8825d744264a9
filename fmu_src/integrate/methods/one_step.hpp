#pragma once

#include <limits>

#include "integrate/methods/methods.hpp"
#include "integrate/methods/shared_scratch.hpp"
#include "integrate/methods/step_control.hpp"

// Base of the one-step methods. It takes their steps; those of dirk are taken by SUNDIALS' ARKODE.
//
// Each advance restarts at (time, y). Only y, the step-size control and, if known, the slope at the start are
// kept. Steps count time from the start of the advance, so that they may be shorter than the rounding error
// of a large time.

namespace redysim {

class ByteReader;
class ByteWriter;
class StepBudget;

class OneStep : public Integrator {
 public:
  Outcome start(double time, const double* y) override;
  void set_state(const double* y) override;
  void begin_communication_step() override;
  Outcome advance(double end, bool inputs_changed) override;

  void pause_after(long steps) override;

  double time() const override { return origin_ + since_; }
  const double* state() const override { return y_.data(); }
  const Statistics& statistics() const override { return statistics_; }

  SolverMethod method() const override { return method_; }
  std::string last_decision() const override;
  // Step size allowed by the tolerance, s; 0: unknown. With several tables: that of the lower order.
  virtual double allowed_step() const { return needs_first_step_ ? 0 : control_.wanted(); }
  // Step size times spectral radius, relative to the stability interval.
  double stability_used(double radius) const {
    return needs_first_step_ ? 0 : control_.wanted() * radius / stability();
  }
  void expect_step(double step);  // call after `start`
  // Whether communication points do not limit the steps while inputs are held.
  virtual bool passes_ends() const { return false; }

  void save(std::vector<unsigned char>& bytes) const override;
  bool restore(const unsigned char* bytes, std::size_t size) override;

 protected:
  // `error_order`: the error estimate is proportional to h^error_order. `tightening`: internal tolerance
  // relative to the user's.
  OneStep(System& system, const SolverSettings& settings, Scratch scratch, SolverMethod method,
          int error_order, double tightening);

  // How a run ended. `step_limit`: allowed_ steps were taken before the end of the advance; all after it are
  // failures.
  enum class Flag { done, step_limit, not_finite, not_closed, too_short, below_rounding, other };

  // Integrates from (since_, y_) to end_ in at most allowed_ steps, into result_, by the step functions
  // below.
  virtual Flag run(double first_step);
  virtual double reached() const { return reached_; }  // time since origin_ that the last run reached

  // Prepares a step of size h from reached_ and result_. False: the slope cannot be computed.
  virtual bool begin_step(double /*h*/) { return false; }
  // Leaves the state after a step of size h in candidate_. Returns the weighted error; infinite: not
  // possible.
  virtual double attempt_error(double /*h*/) { return 0; }
  // Accepts candidate_ at `end` as the new state.
  virtual Flag accept(double end, double h);
  // Number of steps that max_rhs allows in the rest of the advance, the first with a known slope.
  virtual double affordable_steps() const { return std::numeric_limits<double>::infinity(); }
  double affordable() const;  // number of right-hand sides left in the advance

  // Whether the last right-hand side of an accepted step was that of candidate_.
  virtual bool evaluated_candidate() const { return false; }

  virtual double stability() const { return 1; }  // stability interval on the negative real axis

  // A method with several tables chooses one for the rest of an advance, and again after a number of steps.
  // The data of the choice are part of a saved state.
  virtual void choose_table(double /*remaining*/) {}
  virtual long steps_between_choices() const { return std::numeric_limits<long>::max(); }
  virtual void forget_choice() {}
  virtual void put_choice(ByteWriter&) const {}
  virtual bool get_choice(ByteReader& reader);  // must read to the end; false: choice unchanged
  // A method with an interpolating polynomial may pass the end of an advance in its last step, up to
  // farthest_. At the next advance, lies_in_last_step returns true and sets y_ to the state at end_ if that
  // lies in this step, too. Otherwise leave_last_step moves (since_, y_) to the end of that step. Both set
  // slope_known_.
  virtual bool lies_in_last_step(bool /*inputs_changed*/) { return false; }
  virtual void leave_last_step() {}
  void set_error_order(int error_order) {
    error_order_ = error_order;
    control_.set_error_order(error_order);
  }

  // Time since origin_ -> system time; exact at the end of the advance.
  double absolute(double since) const { return since == end_ ? goal_ : origin_ + since; }

  // Step size of the next attempt; reduced so that no contact is missed.
  double step_from(double since, const double* y);
  // Accepts a step of size h to y at `end`. False: the step passed a contact and must be repeated up to it.
  bool keep(double end, const double* y, double h, double error);
  bool repeat(double end, double& h, double error);  // sets h to the next attempt; false: too short
  void repeat_up_to(double h) { touch_ = h; }        // ends the run, to continue with a step of size h
  bool close(double time, double* y);                // projects onto the constraints

  // Stages leave the closed configurations, where overconstrained loops may have more independent rows and no
  // freedom to move: the rows that are dependent at the start of a step remain so until its end. In other
  // loops hold_rank and release_rank do nothing. Call hold_rank after the slope at the start has been
  // evaluated.
  bool is_overconstrained() const { return rank_ > 0; }
  void hold_rank() {
    if (is_overconstrained() && system_.independent_rows() == rank_) system_.hold_rank(true);
  }
  void release_rank() {
    if (is_overconstrained()) system_.hold_rank(false);
  }

  System& system_;
  SolverSettings settings_;
  ErrorWeights error_weights_;
  StepControl control_;
  Scratch scratch_;
  double *result_, *candidate_;  // owned by the scratch

  // state that determines the continuation
  double origin_ = 0;  // end of the last advance that was not paused
  double since_ = 0;   // time since origin_
  std::vector<double> y_;
  std::vector<double> slope_;  // f(time(), y_) with the last inputs, if slope_known_
  bool slope_known_ = false;
  int rank_ = 0;                  // of overconstrained loops; else 0
  bool starts_singular_ = false;  // the start is a singular configuration
  Statistics statistics_;

  // data of the present advance
  double goal_ = 0;                      // its end
  double end_ = 0;                       // goal_ - origin_
  long allowed_ = 0;                     // maximum number of steps of this run
  std::int64_t evaluations_before_ = 0;  // right-hand sides before the advance, for max_rhs
  bool loosened_ = false;                // max_rhs loosened the tolerance in this communication step
  double reached_ = 0;                   // time of result_ since origin_
  double farthest_ = 0;  // upper limit of its last step's end since origin_; end_: must not be passed

 private:
  // Result of a run: end of the advance reached; allowed steps taken; allowed steps taken and the end of the
  // advance out of reach; failure.
  enum class RunEnd { arrived, paused, hopeless, failed };

  void examine_loops();
  bool first_step_from_here();
  void loosen();
  // Prevents a continuation.
  void forget_goal() { goal_ = std::numeric_limits<double>::quiet_NaN(); }
  Outcome run_to_end(bool may_choose);
  bool passes_contact(double since, const double* y, double h);
  Flag attempt();
  bool must_do(double h) const;
  Flag take_step(double& h);
  Flag attempt_until_touch();
  Flag attempt_until_closed();
  RunEnd end_of_run(Flag flag, long taken, StepBudget& budget) const;
  void arrive(double since);
  void set_time(double since);
  std::string reason_of(Flag flag, const StepBudget& budget);

  SolverMethod method_;
  int error_order_;
  bool needs_first_step_ = true;  // no step size known
  double searched_from_ = 0;      // start of the step in which contacts are searched
  // time from there to a contact that the step passed; maximum: none
  double touch_ = std::numeric_limits<double>::max();
};

}  // namespace redysim
