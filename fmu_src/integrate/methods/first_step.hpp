#pragma once

#include "integrate/methods/error_weights.hpp"
#include "integrate/system/system.hpp"

namespace redysim {

// Arrays of length System::size() for first_step, which does not allocate.
struct FirstStepScratch {
  std::vector<double> weights, probe, slope;
  explicit FirstStepScratch(int size)
      : weights(static_cast<std::size_t>(size)), probe(weights), slope(weights) {}
};

// Returns the initial step size, s, for a method of the given order at (time, y) with slope f0 = f(time, y);
// 0: no step is possible. It takes one more right-hand side and is independent of the end of the integration.
// After Hairer, Norsett, Wanner: Solving Ordinary Differential Equations I, 2nd ed., II.4.
double first_step(System& system, const ErrorWeights& error_weights, int order, double time, const double* y,
                  const double* f0, double step_limit, FirstStepScratch& scratch);

}  // namespace redysim
