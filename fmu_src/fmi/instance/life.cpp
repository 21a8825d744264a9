#include "fmi/instance/life.hpp"

#include <algorithm>
#include <cmath>

#include "model/number.hpp"

namespace redysim {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Relative tolerance for the master's times, since masters accumulate steps or count nanoseconds.
constexpr double time_tolerance = 1e-9;

// Minimum step, s; quotients by shorter steps would overflow.
constexpr double shortest_step = 1e-100;

// Minimum rtol that double precision allows.
constexpr double tightest_rtol = 1e-13;

// Maximum deviation of a step's start from the FMU's time: rounding, at most 10 % of the step.
double start_slack(double time, double size) {
  const double rounding = 4 * std::numeric_limits<double>::epsilon() * std::abs(time);
  return std::max(
      {std::min(time_tolerance * std::max(std::abs(time), size), 0.1 * size), rounding, shortest_step});
}

}  // namespace

std::string Life::set_up(bool has_tolerance, double given, double start, bool has_stop, double stop) {
  if (has_tolerance && !(std::isfinite(given) && given > 0))
    return "the tolerance must be a finite number > 0, got " + shown(given);
  if (!std::isfinite(start)) return "the start time must be finite, got " + shown(start);
  if (has_stop && !(std::isfinite(stop) && stop >= start))
    return "the stop time must be finite and not before the start time " + shown(start) + ", got " +
           shown(stop);
  tolerance = has_tolerance ? given : infinity;
  start_time = start;
  stop_time = has_stop ? stop : infinity;
  return {};
}

std::string Life::objection_to_step(double time, double current, double size) const {
  if (!(std::isfinite(size) && size >= 0))
    return "the step size must be finite and not negative, got " + shown(size);
  if (current != time && !(std::abs(current - time) <= start_slack(time, size)))
    return "the step starts at " + shown(current) + " s, but the FMU is at " + shown(time) + " s";
  const double end = current + size;
  if (!std::isfinite(end)) return "the end of the communication step is not finite";
  if (end > stop_time + time_tolerance * std::max(std::abs(stop_time), size))
    return "the step ends at " + shown(end) + " s, after the stop time " + shown(stop_time) + " s";
  return {};
}

SolverSettings Life::effective(SolverSettings settings) const {
  const double wanted = std::max(tolerance, tightest_rtol);
  if (wanted < settings.rtol) {
    settings.atol *= wanted / settings.rtol;
    settings.rtol = wanted;
  }
  return settings;
}

bool is_empty_step(double time, double end) { return end <= time + shortest_step; }

}  // namespace redysim
