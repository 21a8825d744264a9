#include "integrate/methods/step_budget.hpp"

#include <algorithm>

#include "integrate/system/stiffest_joint.hpp"
#include "model/number.hpp"

namespace redysim {
namespace {

constexpr double smallest_checked = 1e7;  // minimum number of steps left for a check
constexpr double growth = 2;              // assumed possible growth of the step size
constexpr double halt = 1e9;              // steps to the end, at which the steps have come to a halt

const char* advice(SolverMethod asked) {
  switch (asked) {
    case SolverMethod::automatic:
      return "lower stiffness, damping or gains, loosen solver.rtol, or use a smaller "
             "communication step size";
    case SolverMethod::bdf:
    case SolverMethod::dirk:
      return "loosen solver.rtol, add damping to the high-frequency modes, or use a smaller "
             "communication step size";
    default:
      return "use solver.method auto, dirk or bdf, or lower stiffness, damping or gains";
  }
}

}  // namespace

// ten times the number of 0.1 ms steps, and enough for a short advance through a difficult interval; at most
// minutes of CPU time
StepBudget::StepBudget(double begin, double end)
    : steps_(static_cast<long>(std::min(1e5 + 1e5 * (end - begin), 1e8))),
      span_(end - begin),
      short_{begin},
      long_{begin} {}

// Whether `steps` of the average size since the last check end before `end`. False within an interval.
bool StepBudget::cannot_reach(double end, double steps, long interval, Check now, Check& last) {
  const std::int64_t taken = now.taken - last.taken;
  if (taken < interval) return false;
  const double average_step = (now.time - last.time) / static_cast<double>(taken);
  last = now;
  return average_step * steps < end - now.time;
}

bool StepBudget::is_hopeless(std::int64_t taken, double time, double end) {
  const Check now = {time, taken};
  const auto left = static_cast<double>(steps_ - taken);
  return cannot_reach(end, halt, short_interval, now, short_) ||
         (left >= smallest_checked && cannot_reach(end, growth * left, long_interval, now, long_));
}

std::string StepBudget::hopeless(const char* method) const {
  return "at the present step size " + std::to_string(steps_) + " internal steps of " + method +
         " would not reach the end of the step";
}

bool StepBudget::is_too_small_for(double max_step) const {
  return max_step > 0 && static_cast<double>(steps_) * max_step < span_;
}

std::string StepBudget::exceeded(System& system, const char* method, const SolverSettings& settings,
                                 double time, const double* y, std::int64_t taken) const {
  const std::string what =
      std::to_string(taken) + " internal steps of " + method + " did not reach the end of the step; ";
  if (is_too_small_for(settings.max_step)) return what + "solver.max_step forbids longer steps: raise it";
  return what + "the stiffest joint has a rate of " + rounded(find_stiffest_joint(system, time, y)) +
         " 1/s: " + advice(settings.method);
}

}  // namespace redysim
