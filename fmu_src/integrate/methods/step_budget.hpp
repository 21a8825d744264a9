#pragma once

#include <string>

#include "integrate/system/system.hpp"

namespace redysim {

// Limits the number of internal steps of an advance, accepted or not, and estimates whether it suffices.
class StepBudget {
 public:
  StepBudget(double begin, double end);  // of the advance, s

  long steps() const { return steps_; }

  // Whether the end is out of reach, by extrapolation of the last `long_interval` steps if the budget is
  // large, and of the last `short_interval` steps if they have nearly come to a halt. An end that would take
  // hours of CPU time is rejected within seconds. Other small budgets are not rejected, since steps may grow
  // after a difficult interval.
  static constexpr long short_interval = 2'000, long_interval = 200'000;
  bool is_hopeless(std::int64_t taken, double time, double end);
  bool is_too_small_for(double max_step) const;  // for steps of SolverSettings::max_step

  // Messages for a failure of the method with this name. `exceeded`, at (time, y) after `taken` steps, names
  // the rate of the stiffest joint and recommends changes depending on the method of the settings.
  std::string hopeless(const char* method) const;
  std::string exceeded(System& system, const char* method, const SolverSettings& settings, double time,
                       const double* y, std::int64_t taken) const;

 private:
  // Steps taken and time at the last check.
  struct Check {
    double time;
    std::int64_t taken = 0;
  };
  static bool cannot_reach(double end, double steps, long interval, Check now, Check& last);

  long steps_;
  double span_;  // length of the advance, s
  Check short_, long_;
};

}  // namespace redysim
