#pragma once

#include <cstdint>
#include <vector>

#include "integrate/system/state_layout.hpp"
#include "math/vec3.hpp"

namespace redysim {

// Direct solution of (I - gamma J) x = b of an implicit method. The row of a position contains 1 and, in the
// column of its velocity, -gamma: positions are eliminated first, without fill-in, and the factor has only
// the other rows.
//
// With D the rows and columns of the other states, C the columns of the positions in these rows and P the
// velocity columns in the position rows, (D + gamma C P) x_other = b_other - C b_q,  x_q = b_q + gamma P
// x_other.
//
// No state depends on the work. Its rows are not factored: a large power must not become a pivot and change
// the rounding of the motion.
//
// The Jacobian may belong to an earlier state. The stiff directions of a rolling body in contact are almost
// constant in the axes of its parent, but rotate quickly in its own axes. If its spherical joint is one of
// `turning_balls`, solve() therefore rotates its part of the vector to the orientation at the Jacobian's
// state.
class NewtonMatrix {
 public:
  [[gnu::cold]] explicit NewtonMatrix(const StateLayout& layout, const std::vector<int>& turning_balls = {});

  // Sets the state of the Jacobian, and the state of the next solutions.
  void set_reference(const double* y) { keep(y, &TurningBall::reference); }
  void set_present(const double* y) { keep(y, &TurningBall::present); }

  // Overwrites a matrix given by its columns with its factors; false: it is singular.
  bool factor(double** columns);

  // Replaces b by x; `columns`: as the last factor() left them.
  void solve(double** columns, double* x);

 private:
  using Quaternion = Eigen::Quaternion<double, Eigen::DontAlign>;
  struct TurningBall {
    int ball = 0;
    Quaternion reference = Quaternion::Identity(), present = reference;
  };

  void keep(const double* y, Quaternion TurningBall::*orientation);
  void turn(double* x, bool to_reference) const;

  StateLayout layout_;
  int positions_, others_, factored_;  // factored_: the others without the work
  std::vector<double*> columns_;       // columns of the other states, from their first row on
  std::vector<std::int64_t> pivots_;
  std::vector<TurningBall> turning_;
};

}  // namespace redysim
