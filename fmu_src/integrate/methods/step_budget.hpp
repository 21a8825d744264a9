#pragma once

#include <string>

#include "integrate/system/system.hpp"

namespace redysim {

// Limits the number of internal steps of an advance, accepted or not, and estimates whether it suffices.
class StepBudget {
 public:
  StepBudget(double begin, double end);  // of the advance, s

  long steps() const { return steps_; }

  // Whether the end is out of reach, by extrapolation of the last `check_interval` steps. An end that would
  // take hours of CPU time is rejected within seconds. Small budgets are never rejected, since steps may grow
  // after a difficult interval.
  static constexpr long check_interval = 200'000;
  bool is_hopeless(std::int64_t taken, double time, double end);
  bool is_too_small_for(double max_step) const;  // for steps of SolverSettings::max_step

  // Messages for a failure of the method with this name. `exceeded`, at (time, y) after `taken` steps, names
  // the rate of the stiffest joint and recommends changes depending on the method of the settings.
  std::string hopeless(const char* method) const;
  std::string exceeded(System& system, const char* method, const SolverSettings& settings, double time,
                       const double* y, std::int64_t taken) const;

 private:
  long steps_;
  double span_;                  // length of the advance, s
  std::int64_t checked_at_ = 0;  // steps taken and time at the last check
  double time_;
};

}  // namespace redysim
