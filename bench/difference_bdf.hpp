#pragma once

#include <memory>

#include "integrate/methods/integrator.hpp"

namespace redysim {

// Plain CVODE BDF with its difference Jacobian and unchanged tolerance, restarted when inputs change. Loops
// are not projected. For comparison only: it cannot be saved.
std::unique_ptr<Integrator> make_difference_bdf(System& system, const SolverSettings& settings);

}  // namespace redysim
