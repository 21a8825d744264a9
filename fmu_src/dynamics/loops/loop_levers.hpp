#pragma once

#include <vector>

#include "dynamics/loops/loop_rows.hpp"

namespace redysim {

// Corrections of q or qd of small mechanisms without masses: delta = -U^2 J^T (J U^2 J^T)^-1 r cancels
// residuals r of the loops to first order, with minimum norm in the units of the joints. J: the levers of the
// rows, U: plan.joint_units. Unlike correct_loops they need no elimination.

// Whether the loops have few rows, which one dense matrix holds, and there are no rigid couplings.
inline bool has_few_loop_rows(const Plan<double>& plan) {
  constexpr int most_rows = 16;
  return plan.couplings.empty() && !plan.loops.empty() &&
         plan.loops.back().first_row + static_cast<int>(plan.loops.back().rows.size()) <= most_rows;
}

// Sets `levers` (nv x rows) to U^2 J^T and `gram` ((rows + 1) x rows) to the Cholesky factor of J U^2 J^T;
// its last line holds the squared bounds of the levers. Uses ws.ground. False: the rows are not clearly
// independent. Requires has_few_loop_rows.
bool factor_levers(const Plan<double>& plan, const Workspace<double>& ws, double* levers, double* gram);

// x <- (J U^2 J^T)^-1 x; x: one entry per row.
void solve_levers(const double* gram, std::vector<double>& x);

}  // namespace redysim
