#pragma once

#include <cstdint>

#include "integrate/methods/tuning.hpp"
#include "model/features.hpp"
#include "model/model.hpp"

// The methods that `auto` chooses from, and the data on which its choice depends.

namespace redysim {

enum class Choice : std::uint8_t { erk, adams, dirk, bdf, exponential };
constexpr int choices = 5;
// A library with Taylor series uses them instead of adams, and as the explicit one-step method; erk then
// only replaces a failed method.
constexpr bool has_series = features::taylor;
constexpr Choice series = Choice::adams, first_choice = has_series ? series : Choice::erk;

constexpr SolverMethod method_of[choices] = {
    SolverMethod::erk, has_series ? SolverMethod::taylor : SolverMethod::adams, SolverMethod::dirk,
    SolverMethod::bdf, SolverMethod::exponential};

inline bool is_implicit(Choice choice) { return choice == Choice::dirk || choice == Choice::bdf; }
inline bool is_series(Choice choice) { return has_series && choice == series; }
inline bool is_multistep(Choice choice) {
  return choice == Choice::bdf || (choice == Choice::adams && !has_series);
}
// Whether the method is a OneStep.
inline bool controls_step(Choice choice) { return !is_multistep(choice) && !is_series(choice); }
inline Choice one_step_like(Choice choice) { return is_implicit(choice) ? Choice::dirk : first_choice; }
inline Choice multistep_like(Choice choice) {
  return is_implicit(choice) ? Choice::bdf : has_series ? first_choice : Choice::adams;
}

// Data that determine the continuation, in addition to the method in use.
struct AutomaticMemory {
  std::uint8_t choice = 0;                       // a Choice
  std::uint8_t home = 0;                         // during a trial the previous method, otherwise `choice`
  std::uint8_t measuring = 0;                    // 1: second part of a trial
  std::uint8_t extensions = 0;                   // number, of a trial whose step size still grows
  std::uint8_t steady = 1;                       // the last two measurements agree
  std::uint8_t limited = 0;                      // 1: by stability, at the last estimate; explicit methods
  std::uint8_t rival = 0;                        // the other method of the last trial
  double changed = 0;                            // time of the last input change, s
  double hold = 0;                               // time between input changes before that, s; 0: unknown
  double interval = Tuning::first_estimate;      // right-hand sides between two estimates
  double estimate_due = Tuning::first_estimate;  // work at which the next estimate is due
  double oscillation = 0;                        // step size times radius of bdf, at the last estimate
  double average_work = 0, average_time = 0;     // of the method before a trial, many measurements
  double interval_begun = 0, interval_work = 0;  // work at the last input change, in the interval before
  double begun = 0;                              // work when the method in use started
  double mark_work = 0, mark_time = 0;           // start of the present measurement of cost
  double older_work = 0, older_time = 0;         // start of the previous measurement
  double failed_cost = 0;                        // of the last failed trial, right-hand sides per second
  double mark_step = 0;                          // step size at the start of the measurement, s
  double home_cost = 0;                          // right-hand sides per second before the trial
  double home_time = 0;                          // time in which that was measured, s
  double step[choices] = {};                     // last step size of each method, s; 0: unknown
  double due[choices] = {}, wait[choices] = {};  // work at which each may be tried; wait after a failed trial

  // Visits all members, to save and restore them.
  template <class SomeMemory, class Visit>
  static void each_part(SomeMemory& memory, const Visit& visit) {
    visit(memory.choice);
    visit(memory.home);
    visit(memory.measuring);
    visit(memory.extensions);
    visit(memory.steady);
    visit(memory.limited);
    visit(memory.rival);
    for (auto* value :
         {&memory.changed, &memory.hold, &memory.interval, &memory.estimate_due, &memory.oscillation,
          &memory.interval_begun, &memory.interval_work, &memory.average_work, &memory.average_time,
          &memory.begun, &memory.older_work, &memory.older_time, &memory.failed_cost, &memory.mark_work,
          &memory.mark_time, &memory.mark_step, &memory.home_cost, &memory.home_time})
      visit(*value);
    for (auto* values : {&memory.step, &memory.due, &memory.wait})
      for (auto& value : *values) visit(value);
  }
};

}  // namespace redysim
