#pragma once

#include <cmath>
#include <memory>
#include <string>

#include "integrate/methods/integrator.hpp"

// Factories of the methods for make_integrator, and their common functions.

namespace redysim {

class OneStep;
class SharedScratch;
using Scratch = std::shared_ptr<SharedScratch>;

// `scratch`: made for `system`, shared by its methods.
std::unique_ptr<OneStep> make_erk(System& system, const SolverSettings& settings, Scratch scratch);
std::unique_ptr<OneStep> make_dirk(System& system, const SolverSettings& settings, Scratch scratch);
std::unique_ptr<OneStep> make_exponential(System& system, const SolverSettings& settings, Scratch scratch);
std::unique_ptr<Integrator> make_adams(System& system, const SolverSettings& settings, Scratch scratch);
std::unique_ptr<Integrator> make_bdf(System& system, const SolverSettings& settings, Scratch scratch);
std::unique_ptr<Integrator> make_taylor(System& system, const SolverSettings& settings);  // without loops
std::unique_ptr<Integrator> make_automatic(System& system, const SolverSettings& settings, Scratch scratch);
std::unique_ptr<Integrator> make_stateless();  // for a system without state

// Whether an advance from `time` to `end` is valid.
inline bool is_later(double end, double time) { return end > time && std::isfinite(end); }

// Minimum step size, s, of an advance to `end`, at `time`, both measured from the start of the advance: the
// time still changes, and steps of a hundredth of a picosecond resolve any motion.
double smallest_step(double time, double end);

// After new inputs: moves y according to jumps of prescribed motions. False: the loop constraints cannot be
// satisfied.
bool follow_motion(System& system, double time, double* y);

// A failed advance from `time`: "Integration stopped at t = ... s: reason"
Outcome failure(double time, const std::string& reason);

// Fails if the start time or state is not finite.
Outcome check_start(double time, const std::vector<double>& y);

namespace reasons {

inline constexpr const char* end_not_later =
    "the end of the step is not finite, or not after the current time";
inline constexpr const char* motion_impossible =
    "the loop constraints cannot be satisfied with the prescribed motion";
inline constexpr const char* loops_open = "the loop constraints cannot be satisfied";
inline constexpr const char* not_finite_at_start =
    "the accelerations at the start of the step are not finite";
inline constexpr const char* not_finite = "the accelerations are not finite";
inline constexpr const char* loops_open_within_max_rhs =
    "the loop constraints cannot be satisfied with the steps that solver.max_rhs allows";
inline constexpr const char* not_finite_within_max_rhs =
    "the accelerations are not finite with the steps that solver.max_rhs allows";
inline constexpr const char* step_too_small = "minimum step size reached; the tolerance cannot be met";
inline constexpr const char* step_too_small_or_not_finite =
    "the accelerations are not finite, or minimum step size reached; the tolerance cannot be met";
inline constexpr const char* tolerance_below_rounding =
    "the tolerance is below the rounding error of the state: loosen solver.rtol and solver.atol";

}  // namespace reasons

}  // namespace redysim
