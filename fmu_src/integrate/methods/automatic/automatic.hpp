#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "integrate/methods/automatic/decision.hpp"
#include "integrate/methods/automatic/memory.hpp"
#include "integrate/methods/methods.hpp"
#include "integrate/methods/one_step.hpp"
#include "integrate/methods/step_budget.hpp"
#include "integrate/system/spectral_radius.hpp"

// Chooses among the methods during the run (docs/solvers.md, constants in tuning.hpp).
//
// A method that promises to be cheaper is tried: it continues the run. After its start, its estimated CPU
// time per second of simulated time is compared with that of the previous method. If it is not cheaper, the
// previous method returns, and the next trial waits longer. Candidates are
//
// * multistep methods, where inputs are held for several steps of the one-step method;
// * implicit methods, where the spectral radius, estimated from time to time, shows that stability limits the
// steps of an explicit one; then dirk instead of bdf or vice versa, and explicit ones where these promise to
// be cheaper.
//
// Inputs that change repeatedly are part of the cost, which is then measured over whole intervals between
// changes. If a method fails, the others continue in turn; the advance fails if all of them fail.

namespace redysim {

class Automatic final : public Integrator {
 public:
  Automatic(System& system, const SolverSettings& settings, Scratch scratch);

  Outcome start(double time, const double* y) override;
  void set_state(const double* y) override { current_->set_state(y); }
  Outcome advance(double end, bool inputs_changed) override;
  void pause_after(long steps) override {
    pause_after_ = steps;
    pause_ = steps > 0 ? std::min(steps, Tuning::steps_between_choices) : Tuning::steps_between_choices;
    for (int k = 0; k < choices; ++k)
      if (methods_[k]) methods_[k]->pause_after(pause_of(static_cast<Choice>(k)));
  }

  double time() const override { return current_->time(); }
  const double* state() const override { return current_->state(); }
  const Statistics& statistics() const override { return statistics_; }
  const char* name() const override { return current_->name(); }
  SolverMethod method() const override { return current_->method(); }

  std::int64_t decisions() const override { return decisions_; }
  std::string last_decision() const override { return decision_.text(); }

  void save(std::vector<unsigned char>& bytes) const override;
  bool restore(const unsigned char* bytes, std::size_t size) override;

 private:
  using Event = Decision::Event;
  // Forecast until the inputs change.
  struct Outlook {
    double span;   // communication step size, s
    double steps;  // steps of the one-step method
    double hold;   // time between two changes, s
  };

  // The part of an advance within one step budget. If the method in use exhausts it, the others get a new
  // one in turn; implicit methods, whose steps can be expensive, for at most the work of the shortest part.
  struct Attempt {
    Attempt(const Automatic& of, double end);
    void begin(const Automatic& of, double end);  // a new budget
    bool is_over(const Automatic& of, std::int64_t taken) const;

    StepBudget budget;
    std::int64_t steps_before = 0;  // of the instance
    double work_before = 0;
    double work_limit = std::numeric_limits<double>::infinity();
    unsigned exhausted = 0;  // bits of the methods that exhausted a budget
    bool tried_bdf = false;  // because an explicit method took a large part of the budget
  };

  // The run (automatic.cpp).
  Integrator& integrator(Choice choice);
  std::unique_ptr<Integrator> made(Choice choice);
  void use(Choice choice);
  void leave_multistep();
  bool replace_failed(unsigned& failed);
  bool replace_exhausted(Attempt& attempt, double end);
  void readmit(unsigned exhausted);
  bool tries_bdf_late(Attempt& attempt, std::int64_t taken, double span);
  void note_change();
  void consider_inputs(double end, bool changed);
  Outcome take_steps(double end, bool inputs_changed);
  void consider(double end, double span);
  void note(Event event, Choice method, Choice other, double cost, double other_cost) {
    decision_ = {event, method, other, time(), cost, other_cost};
    ++decisions_;
  }
  Choice choice() const { return static_cast<Choice>(memory_.choice); }
  const OneStep& erk() const { return static_cast<const OneStep&>(*methods_[static_cast<int>(Choice::erk)]); }
  // Whether communication points do not limit the steps of the one-step method of the same kind.
  bool passes_ends() const { return is_series(choice()) || (!is_implicit(choice()) && erk().passes_ends()); }
  bool is_periodic() const { return memory_.hold > 0 && time() - memory_.changed <= 1.5 * memory_.hold; }
  double expected_hold(double end) const { return std::max(memory_.hold, end - memory_.changed); }
  long pause_of(Choice choice) const {
    return choice == Choice::exponential ? std::min(pause_, Tuning::exponential_between_choices) : pause_;
  }
  bool is_pause_due(std::int64_t taken) const { return pause_after_ > 0 && taken + pause_ > pause_after_; }

  // Costs (account.cpp).
  double work() const;
  double cost() const;
  double present_cost(double span) const;
  double step() const;
  double slope_time(Choice choice) const { return slope_times_[static_cast<std::size_t>(choice)]; }
  double slope_time() const { return slope_time(choice()); }
  double step_work(Choice choice) const {
    return slope_time(choice) * (is_implicit(choice) ? Tuning::dirk_step : Tuning::explicit_stages);
  }
  double trial_work() const { return slope_time() * Tuning::trial_cost; }
  // Right-hand sides after which the step size is no longer influenced by the start of the method.
  double settled_work() const {
    return slope_time() * (is_multistep(choice()) ? Tuning::settled_multistep : Tuning::settled);
  }
  Statistics of_method_in_use() const;
  void count();
  void begin_account();
  void end_measurement();

  // Methods to be tried (candidates.cpp).
  bool may_try(Choice choice) const { return work() >= memory_.due[static_cast<int>(choice)]; }
  double steps_held(double end, double span) const;
  bool is_struggling() const;
  bool consider_one_step(const Outlook& outlook);
  bool consider_multistep(const Outlook& outlook);
  bool adams_pays(const Outlook& outlook) const;
  void consider_stiffness(const Outlook& outlook);
  bool limited_by_stability(double radius, double of_hold) const;
  Choice confirmed(Choice candidate);
  Choice instead_of_explicit(double radius, const Outlook& outlook) const;
  Choice instead_of_other(double radius, const Outlook& outlook);
  bool exponential_pays(double radius, const Outlook& outlook);
  bool vibrates_freely(double radius);

  // Trials (trial.cpp).
  bool is_trial() const { return memory_.home != memory_.choice; }
  void begin_trial(Choice candidate, double span);
  void follow_trial(bool within_hold);
  bool is_hopeless(double spent, double passed) const;
  void judge_trial(double cost);

  System& system_;
  SolverSettings settings_;
  Scratch scratch_;
  SpectralRadius radius_;
  std::array<double, choices> slope_times_;
  // Indexed by Choice; created at initialization, so that no step allocates. Exceptions are created when
  // first tried: the implicit methods of large systems, whose matrices grow with the square of the size, and
  // the exponential method, which needs most memory and is rarely used.
  std::array<std::unique_ptr<Integrator>, choices> methods_;
  long pause_ = Tuning::steps_between_choices;  // internal steps
  Integrator* current_ = &integrator(first_choice);
  AutomaticMemory memory_;
  Statistics before_;      // of the methods used before current_
  Statistics statistics_;  // of all methods
  Decision decision_;      // the last decision
  std::int64_t decisions_ = 0;
};

}  // namespace redysim
