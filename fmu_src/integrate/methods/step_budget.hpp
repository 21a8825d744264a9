#pragma once

#include <string>

#include "integrate/system/system.hpp"

namespace redysim {

// The maximum number of internal steps, accepted or not, of an advance, and whether it suffices.
class StepBudget {
 public:
  StepBudget(double begin, double end);  // of the advance, s

  long steps() const { return steps_; }

  // Whether the end is out of reach by extrapolation of the last `check_interval` steps. An end that is hours
  // of CPU time away is refused within seconds. Small budgets are never refused, since steps may grow after a
  // difficult interval.
  static constexpr long check_interval = 200'000;
  bool is_hopeless(long taken, double time, double end);

  // The reasons of a failure of the method of this name. `exceeded`, at (time, y), names a joint and
  // recommends changes, which depend on the method of the settings.
  std::string hopeless(const char* method) const;
  std::string exceeded(System& system, const char* method, const SolverSettings& settings, double time,
                       const double* y) const;

 private:
  long steps_;
  double span_;          // s
  long checked_at_ = 0;  // steps taken at the last check, and the time then
  double time_;
};

}  // namespace redysim
