#pragma once

#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

#include "fmi2Functions.h"

namespace redysim::drive {

// What to do with one FMU. Read from lines `word value...`, see job.cpp; times in s.
struct Job {
  std::string library, resources, guid;
  double tolerance = 0;  // 0: none is asked for
  double step = 1e-3;
  long steps = 1;
  long every = 1;  // steps between two rows of outputs
  std::vector<std::pair<unsigned, double>> reals;
  std::vector<std::pair<unsigned, std::string>> strings;
  std::vector<fmi2ValueReference> inputs, outputs, integers, names;
  long hold = 1;               // steps that a row of inputs lasts
  std::vector<double> motion;  // rows of inputs, one after the other; the last is followed by the first
  std::vector<fmi2ValueReference> vary;  // a batch: parameters with other values in each run,
  std::vector<double> values;            // one row a run; rows of inputs continue from run to run
  long repeats = 0;                      // further runs, for their time only,
  double spend = 1e9;                    // as long as these have taken less CPU time, s
  double budget = 60;                    // s of CPU time, then the run ends at the current step
  double patience = 30;                  // s after that; then it hangs
  std::vector<long> instances;           // latency: how many live at once
};

// Throws std::runtime_error with a message.
Job read_job(std::istream& stream);

}  // namespace redysim::drive
