#pragma once

#include <string>

#include "dynamics/workspace.hpp"
#include "math/tape.hpp"

namespace redysim {

// Forward dynamics of one model recorded on a tape, with the symbols q[i], qd[i], tau[i] and, for tunable
// parameters, entries of `plan`. tau: inputs of the recursion (InputLayout), without Taylor series including
// friction and stops. Node indices.
struct StraightLine {
  Tape tape;
  std::vector<int> qdd;
  // With prescribed joints, per joint: their drive forces if an output contains their work, otherwise zero.
  std::vector<int> drive;
  // With loops or rigid couplings only: JointRowFactor::margins and corrections (row by row of C), and the
  // residuals and rates of all rows with their sizes.
  std::vector<int> margins, corrections, residual, rate, residual_size, rate_size;
  bool by_composites = false;  // by composite bodies, not by the recursion
  bool has_series = false;     // Taylor series are generated
  std::vector<int> power;      // with series and energies: the power of drives and dampers, W
};

// Records dynamics/aba.hpp or composite_dynamics.hpp, whichever has fewer operations, for a tree, or
// constrained_dynamics.hpp with loops or rigid couplings. Throws std::domain_error for models with bushings
// or contacts.
StraightLine straight_line(const Model& model);

// Number of operations of forward dynamics, with those of corrections and residuals.
int operations(const StraightLine& line);

// Maximum number of operations at which the line is faster than the vectorised recursion (docs/specialise.md)
// and compiles within a minute.
int longest_line(const StraightLine& line);

// The C++ file that defines the symbols below, and those of taylor_series.hpp, for one model; `scene`:
// fingerprint of the model file.
std::string straight_line_source(const StraightLine& line, const std::string& scene);

// Only in a library built with such a file (CMake variable REDYSIM_STRAIGHT_LINE): forward_dynamics of the
// scene with the fingerprint straight_line_scene; qdd and drive from q, qd (plan.nv) and tau as above. False:
// a row of a loop may depend on others, these are not the results.
bool straight_line_forward_dynamics(const Plan<double>& plan, const double* q, const double* qd,
                                    const double* tau, double* qdd, double* drive);
extern const char straight_line_scene[];

// The same for C of JointRowFactor::corrections (nv x rows, row by row).
bool straight_line_corrections(const Plan<double>& plan, const double* q, double* C);

// Residuals and rates of all rows, and the magnitudes of their terms.
void straight_line_residuals(const Plan<double>& plan, const double* q, const double* qd,
                             LoopState<double>& loop);

}  // namespace redysim
