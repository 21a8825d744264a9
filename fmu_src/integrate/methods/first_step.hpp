#pragma once

#include "integrate/methods/error_weights.hpp"
#include "integrate/system/system.hpp"

namespace redysim {

// Room for first_step, so that it does not allocate; each array of length System::size().
struct FirstStepRoom {
  std::vector<double> weights, probe, slope;
  explicit FirstStepRoom(int size)
      : weights(static_cast<std::size_t>(size)), probe(weights), slope(weights) {}
};

// A first step for a method of the given order at (time, y) with slope f0 = f(time, y), from one
// right-hand side beside it; it does not know where the integration ends. 0: no step can be made.
// After Hairer, Norsett, Wanner: Solving Ordinary Differential Equations I, 2nd ed., II.4.
double first_step(System& system, const ErrorWeights& error_weights, int order, double time, const double* y,
                  const double* f0, double largest, FirstStepRoom& room);

}  // namespace redysim
