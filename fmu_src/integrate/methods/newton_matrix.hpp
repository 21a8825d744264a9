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
// With D the rows and columns of the other states, C their columns of the positions and P the columns of the
// velocities, (D + gamma C P) x_other = b_other - C b_q,  x_q = b_q + gamma P x_other.
//
// Nothing depends on the work. Its rows are not factored: a large power must not become a pivot and change
// the rounding of the motion.
//
// The Jacobian may be of an earlier state. The stiff directions of a body in contact hardly turn in the axes
// of its parent, but quickly in its own where it rolls: solve() turns its part of the vector to the
// orientation that it had then, if its spherical joint is one of `turning_balls`.
class NewtonMatrix {
 public:
  [[gnu::cold]] explicit NewtonMatrix(const StateLayout& layout, const std::vector<int>& turning_balls = {});

  // The state of the Jacobian, and that of the next solutions.
  void set_reference(const double* y) { keep(y, &TurningBall::reference); }
  void set_present(const double* y) { keep(y, &TurningBall::present); }

  // Overwrites a matrix given by its columns; false: it is singular.
  bool factor(double** columns);

  // b -> x, with the matrix as the last factor() left it.
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
  int positions_, others_, factored_;  // factored: the others without the work
  std::vector<double*> columns_;       // of the others, from their first row on
  std::vector<std::int64_t> pivots_;
  std::vector<TurningBall> turning_;
};

}  // namespace redysim
