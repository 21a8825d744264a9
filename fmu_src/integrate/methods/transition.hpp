#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "integrate/methods/integrator.hpp"
#include "integrate/system/dense_jacobian.hpp"

namespace redysim {

// Integrates a system together with the derivatives of its state by the state at the start and by constant
// knowns (the variational equations Y' = J Y + G). Radau IIA of order 5 (Hairer and Wanner, Solving Ordinary
// Differential Equations II, IV.5 and table 5.6), differentiated exactly at its stages, so the derivatives
// are those of the discrete motion; the step size follows from their error.
class Transition {
 public:
  // Columns of length System::size(): the derivatives of ydot by the knowns. `jacobian`: at the same point,
  // with the columns of inputs.
  using Knowns =
      std::function<Status(double time, const double* y, const DenseJacobian& jacobian, double* columns)>;

  // `system` must outlive it and have no work in its state. `columns`: all those of Y, the knowns last.
  Transition(System& system, int columns, int knowns, Knowns by_knowns);

  // Moves y and Y (by columns) from `time` to `end`; the relative error of each column of Y is about `rtol`.
  Outcome advance(double time, double end, double rtol, double* y, double* columns);

 private:
  static constexpr int stages = 3;

  bool step(double time, double h);
  bool set_residuals(double time, double h);
  bool solve_stages(double time, double h);
  void solve(double* x);  // the right-hand side before
  bool factor(double h, const double* const (&jacobians)[stages]);
  Status linearise(int place, double time, const double* y);
  void set_slope(std::size_t column, int place, const double* y, double* slope) const;
  void differentiate(double h);
  double error(double h) const;
  void set_weights();
  double norm(const double* column) const;
  double* stage(std::vector<double>& of, int index) { return &of[static_cast<std::size_t>(index) * size_]; }

  System& system_;
  DenseJacobian jacobian_;
  Knowns by_knowns_;
  std::size_t size_;
  std::size_t positions_,
      velocity_;      // of joints with one degree of freedom: their number, the first velocity
  std::size_t rest_;  // entries of the state without these positions
  std::size_t columns_, knowns_;
  double span_ = 0, rtol_ = 0;                 // of the advance
  std::vector<double> weights_;                // of the rows of a column, all as velocities
  const double *y_ = nullptr, *y0_ = nullptr;  // Y and y at the start of the step
  std::vector<double> slope_;                  // at the start of the step
  std::vector<double> jacobians_, gains_;      // at the start and the stages
  std::vector<double> move_, slopes_;          // of the stages
  std::vector<double> matrix_, reduced_, unknowns_;
  std::vector<double*> matrix_columns_;
  std::vector<std::int64_t> pivots_;
  double h_ = 0;                       // of the matrix
  const double* solved_[stages]{};     // its Jacobians
  std::vector<double> y_next_, next_;  // y and Y at the end of the step
};

}  // namespace redysim
