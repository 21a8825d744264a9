#pragma once

#include <cstdint>
#include <vector>

#include "integrate/system/state_layout.hpp"

namespace redysim {

// Direct solution of (I - gamma J) x = b of an implicit method. The row of a position contains 1 and, in the
// column of its velocity, -gamma: positions are eliminated first, without fill-in, and the factor has only
// the other rows.
//
// With D the rows and columns of the other states, C their columns of the positions and P the columns of the
// velocities, (D + gamma C P) x_other = b_other - C b_q,  x_q = b_q + gamma P x_other.
//
// Nothing depends on the work. Its rows are not factored: a large power must not become a pivot and change
// the rounding of the motion.
class NewtonMatrix {
 public:
  explicit NewtonMatrix(const StateLayout& layout);

  // Overwrites a matrix given by its columns; false: it is singular.
  bool factor(double** columns);

  // b -> x, with the matrix as the last factor() left it.
  void solve(double** columns, double* x);

 private:
  StateLayout layout_;
  int positions_, others_, factored_;  // factored: the others without the work
  std::vector<double*> columns_;       // of the others, from their first row on
  std::vector<std::int64_t> pivots_;
};

}  // namespace redysim
