#pragma once

#include <memory>
#include <string>

#include "integrate/integrator.hpp"

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

// The smallest step that still moves the clock of an advance that ends at `end`.
double smallest_step(double time, double end);

// After new inputs: y follows a prescribed motion that jumped. False: loops cannot close.
bool follow_motion(System& system, double time, double* y);

// A failed advance from `time`: "Integration stopped at t = ... s: reason"
Outcome failure(double time, const std::string& reason);

// The reason where an advance used up its allowed_steps at (time, y), and what to do about it; blames a
// joint.
std::string too_many_steps(System& system, long allowed, const char* method, double time, const double* y);

}  // namespace redysim
