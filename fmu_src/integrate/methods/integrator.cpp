#include "integrate/methods/integrator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "integrate/control/reference.hpp"
#include "integrate/methods/methods.hpp"
#include "integrate/methods/one_step.hpp"
#include "model/features.hpp"
#include "model/number.hpp"

namespace redysim {

namespace {

std::unique_ptr<Integrator> make_of_sundials(System& system, const SolverSettings& settings,
                                             const Scratch& scratch) {
  switch (settings.method) {
    case SolverMethod::adams:
      if constexpr (features::adams) return make_adams(system, settings, scratch);
      break;
    case SolverMethod::bdf:
      if constexpr (features::bdf) return make_bdf(system, settings, scratch);
      break;
    case SolverMethod::dirk:
      if constexpr (features::dirk) return make_dirk(system, settings, scratch);
      break;
    case SolverMethod::exponential:
      if constexpr (features::exponential) return make_exponential(system, settings, scratch);
      break;
    default:
      break;
  }
  if constexpr (features::erk) return make_erk(system, settings, scratch);
  return nullptr;  // missing_feature has already refused the model
}

}  // namespace

std::unique_ptr<Integrator> make_integrator(System& system, const SolverSettings& settings) {
  if (system.size() == 0) return make_stateless();
  if constexpr (features::taylor)
    if (settings.method == SolverMethod::taylor) return make_taylor(system, settings);
  const Scratch scratch = std::make_shared<SharedScratch>(system);
  if constexpr (features::erk && features::adams && features::dirk && features::bdf && features::exponential)
    if (settings.method == SolverMethod::automatic && !(settings.max_rhs > 0))
      return make_automatic(system, settings, scratch);
  return make_of_sundials(system, settings, scratch);
}

double next_halt(const System& system, double time, double end) {
  // the remainder after a breakpoint must be a step, not a rounding error
  const double breakpoint = system.next_breakpoint(time);
  return breakpoint < end - time_rounding(end) ? breakpoint : end;
}

Outcome advance_by_breakpoints(Integrator& integrator, System& system, double end, bool inputs_changed) {
  for (;;) {
    const double time = integrator.time();
    const bool phase_entered = system.enter_phases(time);
    const bool entered = system.enter_samples(time, integrator.state()) || phase_entered;
    const double halt = next_halt(system, time, end);
    const Outcome outcome = integrator.advance(halt, inputs_changed || entered);
    const bool paused = integrator.pauses() || integrator.time() < halt;
    if (!outcome.ok || halt == end || !(halt > time) || paused) return outcome;
    inputs_changed = false;
  }
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

Outcome check_start(double time, const std::vector<double>& y) {
  if (!std::isfinite(time)) return failure(time, "the start time is not finite");
  for (double value : y)
    if (!std::isfinite(value)) return failure(time, "the start state is not finite");
  return {};
}

}  // namespace redysim
