#include "integrate/methods/integrator.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "integrate/methods/methods.hpp"
#include "integrate/methods/one_step.hpp"
#include "integrate/system/stiffest_joint.hpp"
#include "model/features.hpp"
#include "model/read/number.hpp"

namespace redysim {
std::unique_ptr<Integrator> make_integrator(System& system, const SolverSettings& settings) {
  if (system.size() == 0) return make_still();
  switch (settings.method) {
    case SolverMethod::adams:
      if constexpr (features::adams) return make_adams(system, settings);
      break;
    case SolverMethod::bdf:
      if constexpr (features::bdf) return make_bdf(system, settings);
      break;
    case SolverMethod::dirk:
      if constexpr (features::dirk) return make_dirk(system, settings);
      break;
    case SolverMethod::automatic:
      if constexpr (features::erk && features::adams && features::dirk && features::bdf)
        return make_automatic(system, settings);
      break;
    case SolverMethod::erk:
      break;
  }
  if constexpr (features::erk) return make_erk(system, settings);
  return nullptr;  // missing_feature has refused the model before
}

Outcome advance_by_borders(Integrator& integrator, System& system, double end, bool inputs_changed) {
  for (;;) {
    const double time = integrator.time();
    const bool entered = system.enter_phases(time);
    // what is left behind a border must be a step, not rounding
    const double slack = 1e-12 * std::max(1.0, std::fabs(end)), border = system.next_border(time);
    const double halt = border < end - slack ? border : end;
    const Outcome outcome = integrator.advance(halt, inputs_changed || entered);
    if (!outcome.ok || halt == end || !(halt > time)) return outcome;
    inputs_changed = false;
  }
}

long allowed_steps(double length) {
  // ten times what 0.1 ms steps need, and enough for a short advance through a rough patch; minutes at most
  return static_cast<long>(std::min(1e5 + 1e5 * length, 1e8));
}

bool Pace::is_hopeless(long steps, long allowed, double time, double end) {
  if (steps - steps_ < looks_after || allowed - steps < many) return false;
  const double covered = (time - time_) / static_cast<double>(steps - steps_);
  steps_ = steps;
  time_ = time;
  return growth * covered * static_cast<double>(allowed - steps) < end - time;
}

std::string Pace::sentence(long allowed, const char* method) {
  return "at this pace " + std::to_string(allowed) + " internal steps of " + method +
         " would not reach the end of the step";
}

double smallest_step(double time, double end) {
  return 16 * std::numeric_limits<double>::epsilon() * std::max(time, std::min(end, 1.0));
}

bool follow_motion(System& system, double time, double* y) {
  const bool closed = system.follow_jumps(time, y);
  system.forget_jumps();
  return closed;
}

Outcome failure(double time, const std::string& reason) {
  const bool ended = !reason.empty() && reason.back() == '.';
  return {false, "Integration stopped at t = " + shown(time) +
                     " s: " + reason.substr(0, reason.size() - (ended ? 1 : 0))};
}

std::string too_many_steps(System& system, long allowed, const char* method, double time, const double* y) {
  const double rate = blame_stiffest_joint(system, time, y);
  const bool implicit = std::strncmp(method, "bdf", 3) == 0 || std::strncmp(method, "dirk", 4) == 0;
  return std::to_string(allowed) + " internal steps of " + method +
         " did not reach the end of the step; the stiffest joint has a rate of " + rounded(rate) + " 1/s: " +
         (implicit ? "loosen solver.rtol, damp what rings, or take shorter steps"
                   : "use solver.method dirk or bdf, or lower stiffness, damping or gains");
}

}  // namespace redysim
