#pragma once

#include <memory>

#include "integrate/methods/integrator.hpp"

namespace redysim {

// CVODE BDF as it comes, with its difference Jacobian: the tolerance as given, begun anew where inputs
// change. Loops are not projected. For comparison only: it cannot be saved.
std::unique_ptr<Integrator> make_difference_bdf(System& system, const SolverSettings& settings);

}  // namespace redysim
