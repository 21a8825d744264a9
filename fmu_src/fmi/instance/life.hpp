#pragma once

#include <limits>
#include <string>

#include "fmi/boundary/call_table.hpp"
#include "model/model.hpp"

namespace redysim {

// The FMI state of an instance and the experiment of its master.
struct Life {
  State state = State::instantiated;
  double start_time = 0;
  double stop_time = std::numeric_limits<double>::infinity();
  double tolerance = std::numeric_limits<double>::infinity();  // relative, set by the master

  // Returns why the experiment is invalid, empty on success.
  std::string set_up(bool has_tolerance, double tolerance, double start, bool has_stop, double stop);
  // Why the step from `current` by `size` is invalid at `time`; empty if it is valid.
  std::string objection_to_step(double time, double current, double size) const;
  // The master's tolerance tightens rtol and atol of the model by the same factor and never loosens them.
  SolverSettings effective(SolverSettings settings) const;
};

// Whether a step from `time` to `end` has no duration.
bool is_empty_step(double time, double end);

}  // namespace redysim
