#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <vector>

#include "integrate/methods/integrator.hpp"
#include "integrate/system/dense_jacobian.hpp"

namespace redysim {

// Integrates a system together with the derivatives of its state by the state at the start and by constant
// knowns (variational equations Y' = J Y + G). The method is collocation with exact derivatives at the
// stages. A smooth motion is one step of Gauss's method of order 4, 6 or 8, which must end at the known end
// state. Any other motion is integrated by Radau IIA of order 5, whose step size follows from the error of
// the derivatives (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5).
class Transition {
 public:
  // Sets the columns, of length System::size(), to the derivatives of ydot by the knowns. `jacobian`:
  // evaluated at this point, with the columns of the inputs.
  using Knowns =
      std::function<Status(double time, const double* y, const DenseJacobian& jacobian, double* columns)>;

  // `system` must outlive this object and have no work in its state. `columns`: number of columns of Y,
  // knowns last.
  Transition(System& system, int columns, int knowns, Knowns by_knowns);

  // Moves y and Y (column-major) from `time` to `end`; the relative error of each column of Y is about
  // `rtol`. `y_end`: y at `end`, computed by another method with this tolerance; null: unknown.
  Outcome advance(double time, double end, double rtol, double* y, double* columns, const double* y_end);

 private:
  static constexpr std::size_t most_stages = 4;

  // A collocation method: integrals of the Lagrange polynomials of its nodes.
  struct Method {
    explicit Method(std::initializer_list<double> nodes);
    std::size_t stages;
    double times[most_stages];
    double table[most_stages][most_stages], weights[most_stages];  // integrals up to the nodes, up to 1
    double start[most_stages];                                     // values of the polynomials at 0
    double highest[most_stages];                                   // their derivatives of order stages - 1
    // For Gauss's methods and exp(z): error of the polynomial through exp at the nodes, at both ends,
    // relative to z^stages; error of the step relative to z^(2 stages + 1).
    double extrapolation, error;
    double squared(std::size_t i, std::size_t j) const;  // entry of table^2
  };

  bool advance_smoothly(double time, const double* y_end);
  double smooth_step(double time, const double* y_end);
  double iterate_stages(double time, const double* y_end);
  double angle_of_motion();
  bool is_accurate(double angle) const;
  bool agrees(const double* y_end) const;
  Outcome advance_by_steps(double time, double end, double* y);
  bool step(double time, double h);
  double error(double h);
  bool solve_stages(double time, double h);
  bool set_residuals(double time, double h);
  bool factor(double h, const double* const (&jacobians)[most_stages]);
  void solve(double* x, std::size_t count);
  Status linearise(std::size_t place, double time, const double* y);
  bool linearise_stages(double time, double h);
  void set_slopes(std::size_t place, double* slopes) const;
  bool differentiate(double h);
  void set_weights();
  void set_rounding(double time, const double* y);
  // Slopes of columns at the stages, and the columns before and after the step, all row-major.
  // `known_weights`: weights of the columns from `first_known` on.
  struct Rows {
    const double *slopes, *before, *after;
    std::size_t count, first_known;
    const double* known_weights;
  };
  double relative_size(const Rows& rows, const double* factors, const double* at_start);
  double least_size(const Rows& rows, std::size_t known) const;
  double* stage(std::vector<double>& of, std::size_t index) { return &of[index * size_]; }

  System& system_;
  DenseJacobian jacobian_;
  Knowns by_knowns_;
  std::size_t size_;
  std::size_t positions_,
      velocity_;      // joints with one degree of freedom: number of positions, index of the first velocity
  std::size_t rest_;  // entries of the state without these positions
  std::size_t columns_, knowns_;
  std::vector<Method> methods_;  // Gauss's, then Radau IIA
  const Method* method_;
  double span_ = 0, rtol_ = 0;  // length of the advance, s, and its tolerance
  std::vector<double> weights_,
      rate_weights_;                       // of rows of Y, as velocities; the latter without positions
  std::vector<double> rounding_;           // rounding error of G, per known, as velocity; 0: unknown
  const double* y0_ = nullptr;             // y at the start of the step
  std::vector<double> slope_, end_slope_;  // slopes at the start of the step and at y_end
  std::vector<double> jacobians_, gains_;  // at the start (place 0) and at the stages
  std::vector<double> move_, slopes_;      // at the stages; move_: change of y since the start
  std::vector<double> matrix_;
  std::vector<double*> matrix_columns_;
  std::vector<std::int64_t> pivots_;
  double h_ = 0;                         // step size of the factored matrix
  const double* solved_[most_stages]{};  // its Jacobians
  std::vector<double> reduced_, position_, defects_, sizes_;
  std::vector<double> y_next_;                   // y at the end of the step
  std::vector<double> columns_before_, before_;  // Y and its slopes at the start of the step, row-major
  std::vector<double> changes_, next_;           // slopes of Y at the stages, Y at the end, row-major
};

}  // namespace redysim
