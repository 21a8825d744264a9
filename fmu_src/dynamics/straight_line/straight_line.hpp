#pragma once

#include <string>

#include "dynamics/plan.hpp"
#include "math/tape.hpp"

namespace redysim {

// Forward dynamics of one model recorded on a tape, with the symbols q[i], qd[i], tau[i] and, for tunable
// parameters, entries of `plan`.
struct StraightLine {
  Tape tape;
  std::vector<int> qdd;        // node indices
  bool by_composites = false;  // by composite bodies, not by the recursion
  bool has_series = false;     // Taylor series are generated
  std::vector<int> power;      // with series and energies: node of the power of drives and dampers, W
};

// Records dynamics/aba.hpp or composite_dynamics.hpp, whichever has fewer operations, for an open tree of
// force-driven joints. Throws std::domain_error for other models.
StraightLine straight_line(const Model& model);

// Number of operations of `line`.
int operations(const StraightLine& line);

// Maximum number of operations at which the line is faster than the vectorised recursion (docs/specialise.md)
// and compiles within a minute.
int longest_line(const StraightLine& line);

// The C++ file that defines the two symbols below, and those of taylor_series.hpp, for one model; `scene`:
// fingerprint of the model file.
std::string straight_line_source(const StraightLine& line, const std::string& scene);

// Only in a library built with such a file (CMake variable REDYSIM_STRAIGHT_LINE): forward_dynamics of the
// scene with the fingerprint straight_line_scene; qdd from q, qd, tau (plan.nv each).
void straight_line_forward_dynamics(const Plan<double>& plan, const double* q, const double* qd,
                                    const double* tau, double* qdd);
extern const char straight_line_scene[];

}  // namespace redysim
