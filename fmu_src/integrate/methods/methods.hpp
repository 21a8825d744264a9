#pragma once

#include <memory>
#include <string>

#include "integrate/methods/integrator.hpp"

// The methods behind make_integrator, and what they share.

namespace redysim {

class OneStep;

std::unique_ptr<OneStep> make_erk(System& system, const SolverSettings& settings);
std::unique_ptr<OneStep> make_dirk(System& system, const SolverSettings& settings);
std::unique_ptr<Integrator> make_adams(System& system, const SolverSettings& settings);
std::unique_ptr<Integrator> make_bdf(System& system, const SolverSettings& settings);
std::unique_ptr<Integrator> make_automatic(System& system, const SolverSettings& settings);
std::unique_ptr<Integrator> make_still();  // for a system without state

// Internal steps, accepted or not, that an advance over `length` seconds may take.
long allowed_steps(double length);

// Tells early that the steps that an advance may take will not do, by the time that the last of them covered:
// an end that is hours of computing away is refused within seconds. Where not that many are allowed, nothing
// is foretold: after a rough patch steps may grow.
class Pace {
 public:
  static constexpr long looks_after = 200'000;  // steps
  static constexpr long many = 10'000'000;      // left
  static constexpr double growth = 2;           // of the pace, that may be hoped for
  explicit Pace(double time) : time_(time) {}
  bool is_hopeless(long steps, long allowed, double time, double end);
  static std::string sentence(long allowed, const char* method);

 private:
  long steps_ = 0;
  double time_;
};

// The smallest step of an advance that ends at `end`, at a time since it began: it still moves the clock, and
// nothing is as fast as a hundredth of a picosecond.
double smallest_step(double time, double end);

// After new inputs: y follows a prescribed motion that jumped. False: loops cannot close.
bool follow_motion(System& system, double time, double* y);

// A failed advance from `time`: "Integration stopped at t = ... s: reason"
Outcome failure(double time, const std::string& reason);

// A reason.
inline constexpr const char* tolerance_below_rounding =
    "the tolerance is below the rounding of the state: loosen solver.rtol and solver.atol";

// The reason where an advance used up its allowed_steps at (time, y), and what to do about it; blames a
// joint.
std::string too_many_steps(System& system, long allowed, const char* method, double time, const double* y);

}  // namespace redysim
