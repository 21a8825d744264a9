#pragma once

#include <algorithm>
#include <array>

#include "integrate/methods/methods.hpp"
#include "integrate/methods/shared_room.hpp"
#include "integrate/methods/tuning.hpp"
#include "integrate/system/spectral_radius.hpp"

// Chooses among the four methods during the run (docs/solvers.md, constants in tuning.hpp).
//
// A method that promises to be cheaper is tried: it continues the run, and after its start its right-hand
// sides per second of motion are compared with those of the method before it. If it is not cheaper, that
// method returns, and the next trial waits longer. Candidates are
//
// * multistep methods, where inputs are held for several steps of the one-step method;
// * implicit methods, where the spectral radius, estimated from time to time, shows that stability limits the
//   steps of an explicit one; then dirk or bdf instead of the other, and explicit ones where they promise it.
//
// Inputs that change again and again are part of the cost: it is then measured over whole intervals between
// changes. Where a method fails, the others continue in turn; the advance fails where all do.

namespace redysim {

class Automatic final : public Integrator {
 public:
  Automatic(System& system, const SolverSettings& settings, Room room);

  Outcome start(double time, const double* y) override;
  void set_state(const double* y) override { current_->set_state(y); }
  Outcome advance(double end, bool inputs_changed) override;
  void pause_after(long steps) override {
    pause_after_ = steps;
    pause_ = steps > 0 ? std::min(steps, Tuning::steps_between_choices) : Tuning::steps_between_choices;
    for (const auto& method : methods_)
      if (method) method->pause_after(pause_);
  }

  double time() const override { return current_->time(); }
  const double* state() const override { return current_->state(); }
  const Statistics& statistics() const override { return statistics_; }
  const char* name() const override { return current_->name(); }
  SolverMethod method() const override { return current_->method(); }

  long decisions() const override { return noted_; }
  std::string last_decision() const override;

  void save(std::vector<unsigned char>& bytes) const override;
  bool restore(const unsigned char* bytes, std::size_t size) override;

 private:
  enum class Choice : std::uint8_t { erk, adams, dirk, bdf };
  static constexpr int choices = 4;
  static bool is_implicit(Choice choice) { return choice >= Choice::dirk; }
  static bool is_multistep(Choice choice) { return choice == Choice::adams || choice == Choice::bdf; }
  static Choice one_step_like(Choice choice) { return is_implicit(choice) ? Choice::dirk : Choice::erk; }
  static Choice multistep_like(Choice choice) { return is_implicit(choice) ? Choice::bdf : Choice::adams; }

  // What the continuation depends on, in addition to the method in use.
  struct Memory {
    std::uint8_t choice = 0;                       // a Choice
    std::uint8_t home = 0;                         // during a trial the method before it, otherwise `choice`
    std::uint8_t measuring = 0;                    // second part of a trial
    std::uint8_t extensions = 0;                   // of a trial whose step size still grows
    std::uint8_t steady = 1;                       // the last two measurements agree
    std::uint8_t rival = 0;                        // the other method of the last trial
    double changed = 0;                            // s, when the inputs changed last
    double hold = 0;                               // s, for which they were held before that; 0: unknown
    double interval = Tuning::first_estimate;      // right-hand sides between two estimates
    double estimate_due = Tuning::first_estimate;  // work
    double radius = 0;                             // 1/s, at the last estimate
    double oscillation = 0;                        // step times radius of bdf, at the last estimate
    double same_step = 0, same_since = 0;          // s, of adams; work since which it is the same
    double explicit_work = 0;                      // right-hand sides of stability in a trial, until
    double sampled = 0, sampled_work = 0;          // s, the last estimate; work then
    double average_work = 0, average_time = 0;     // of the method before a trial, over many measurements
    double interval_begun = 0, interval_work = 0;  // work at the last change, and of the interval before it
    double begun = 0;                              // work when the method in use began
    double mark_work = 0, mark_time = 0;           // start of the present measurement of cost
    double older_work = 0, older_time = 0;         // of that before it
    double failed_cost = 0;                        // of the last failed trial, right-hand sides per second
    double mark_step = 0;                          // s
    double home_cost = 0;                          // right-hand sides per second before the trial
    double step[choices] = {};                     // s, last of each method, 0: unknown
    double due[choices] = {},
           wait[choices] = {};  // work at which each may be tried, and after a failed trial
  };

  // All of Memory, to be saved and restored.
  template <class SomeMemory, class Visit>
  static void each_part(SomeMemory& memory, const Visit& visit) {
    visit(memory.choice);
    visit(memory.home);
    visit(memory.measuring);
    visit(memory.extensions);
    visit(memory.steady);
    visit(memory.rival);
    for (auto* value :
         {&memory.changed,       &memory.hold,           &memory.interval,      &memory.estimate_due,
          &memory.oscillation,   &memory.interval_begun, &memory.interval_work, &memory.average_work,
          &memory.average_time,  &memory.begun,          &memory.older_work,    &memory.older_time,
          &memory.failed_cost,   &memory.mark_work,      &memory.mark_time,     &memory.mark_step,
          &memory.home_cost,     &memory.radius,         &memory.same_step,     &memory.same_since,
          &memory.explicit_work, &memory.sampled,        &memory.sampled_work})
      visit(*value);
    for (auto* values : {&memory.step, &memory.due, &memory.wait})
      for (auto& value : *values) visit(value);
  }

  // The last decision, for the log.
  enum class Event : std::uint8_t { tried, stays, returns, restarts, replaces };
  struct Note {
    Event event = Event::tried;
    Choice method = Choice::erk, other = Choice::erk;
    double time = 0, cost = 0, other_cost = 0;
  };
  void note(Event event, Choice method, Choice other, double cost, double other_cost) {
    note_ = {event, method, other, time(), cost, other_cost};
    ++noted_;
  }

  Choice choice() const { return static_cast<Choice>(memory_.choice); }
  Integrator& integrator(Choice choice);
  std::unique_ptr<Integrator> made(Choice choice);
  bool is_trial() const { return memory_.home != memory_.choice; }
  bool may_try(Choice choice) const { return work() >= memory_.due[static_cast<int>(choice)]; }
  double step() const;
  double steps_held(double end, double span) const;
  bool restarts_pay(double end, double span) const {
    return memory_.hold == 0 || steps_held(end, span) >= Tuning::held_for_restart;
  }
  bool is_pause_due(long taken) const { return pause_after_ > 0 && taken + pause_ > pause_after_; }
  bool is_periodic() const { return memory_.hold > 0 && time() - memory_.changed <= 1.5 * memory_.hold; }
  bool limited_by_stability(double radius, double of_hold) const;
  void use(Choice choice);
  void note_change();
  void leave_multistep();
  bool replace_failed(unsigned& failed);
  void note_step();
  void consider(double end, double span);
  // What is expected until the inputs change.
  struct Outlook {
    double span;   // s, of the communication step
    double steps;  // of the one-step method
    double hold;   // s, between two changes
  };
  bool consider_one_step(const Outlook& outlook);
  bool consider_multistep(const Outlook& outlook);
  bool adams_pays(const Outlook& outlook, double used) const;
  bool is_estimate_due(const Outlook& outlook) const;
  void consider_stiffness(const Outlook& outlook);
  Choice instead_of_explicit(double radius, const Outlook& outlook) const;
  Choice instead_of_implicit(double radius, const Outlook& outlook);
  double expected_hold(double end) const { return std::max(memory_.hold, end - memory_.changed); }
  void begin_trial(Choice candidate, double span);
  bool is_hopeless(double spent, double passed) const;
  double home_cost() const;
  // Right-hand sides per second of explicit steps at their stability limit.
  static double explicit_cost(double radius) {
    return Tuning::explicit_stages / Tuning::explicit_step * radius;
  }
  double estimate_radius();
  bool is_stuck() const {
    return choice() == Choice::adams && work() - memory_.same_since > Tuning::stuck_work;
  }
  void watch_stiffness();
  void follow_trial(bool within_hold);
  void judge_trial(double cost);
  double jacobian_work() const;  // right-hand sides
  double work() const;
  double cost() const;
  // Right-hand sides after which the step size is that of the method, not of its start.
  double settled_work() const { return is_multistep(choice()) ? Tuning::settled_multistep : Tuning::settled; }
  static double stages(Choice choice) {
    return is_implicit(choice) ? Tuning::dirk_step : Tuning::explicit_stages;
  }
  void begin_account();
  void end_measurement();
  void count();

  System& system_;
  SolverSettings settings_;
  Room room_;
  SpectralRadius radius_;
  // As Choice numbers them, all created at initialization, so that no step allocates. The matrices of
  // implicit methods grow with the square of the size: those of large systems are created when they are first
  // tried.
  std::array<std::unique_ptr<Integrator>, choices> methods_;
  long pause_ = Tuning::steps_between_choices;  // internal steps
  Integrator* current_ = &integrator(Choice::adams);
  Memory memory_;
  Statistics before_;      // of the methods used before the one in use
  Statistics statistics_;  // all
  Note note_;
  long noted_ = 0;
};

}  // namespace redysim
