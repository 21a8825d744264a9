#pragma once

#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

#include "fmi2Functions.h"

namespace redysim::drive {

// A job for one FMU, read from lines `word value...` (see job.cpp). Times are in s.
struct Job {
  std::string library, resources, guid;
  double tolerance = 0;  // 0: tolerance is not set
  double step = 1e-3;
  long steps = 1;
  long every = 1;  // steps between two rows of recorded outputs
  std::vector<std::pair<unsigned, double>> reals;
  std::vector<std::pair<unsigned, std::string>> strings;
  std::vector<fmi2ValueReference> inputs, outputs, integers, names;
  long hold = 1;                         // number of steps with the same row of inputs
  std::vector<double> motion;            // rows of inputs, repeated after the last one
  std::vector<fmi2ValueReference> vary;  // batch: parameters that differ between runs
  std::vector<double> values;            // one row per run; inputs continue from run to run
  long repeats = 0;                      // maximum number of further runs for timing
  double spend = 1e9;                    // CPU time after which these stop, s
  double budget = 60;                    // CPU time after which the run ends at the current step, s
  double patience = 30;                  // further CPU time after which the run is a hang, s
  std::vector<long> instances;           // for latency: numbers of simultaneous instances
};

// Throws std::runtime_error with a message if the job is not valid.
Job read_job(std::istream& stream);

}  // namespace redysim::drive
