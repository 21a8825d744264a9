#pragma once

#include <utility>
#include <vector>

#include "dynamics/derivatives.hpp"
#include "integrate/system/system.hpp"

namespace redysim {

// Exact Jacobian d(ydot)/dy of a system (dynamics/derivatives.hpp), for the implicit methods.
class DenseJacobian {
 public:
  // `by_inputs`: also keep the columns of all joint inputs.
  explicit DenseJacobian(System& system, bool by_inputs = false);

  // Fills `matrix` (column-major, columns of length System::size()) and `slope` with ydot, without work
  // (null: not needed). Costs about one right-hand side per column and one more, which counts as an
  // evaluation.
  Status evaluate(double time, const double* y, double* matrix, double* slope = nullptr);

  // d(ydot)/d(drive input of a joint) at the last point, length System::size(); false: no such column.
  bool by_input(int joint, double* column) const;

 private:
  const double* column(int variable) const {
    return &columns_[static_cast<std::size_t>(variable) * change_.size()];
  }
  double* column(int variable) { return const_cast<double*>(std::as_const(*this).column(variable)); }
  void add_rows(const double* change, double* column) const;
  int force_of(int joint) const;
  void add_drives(bool all);
  void add_actuators(const double* y, double* matrix);
  void add_actuator(int index, const double* y, double* matrix);
  void set_ball(int ball, const double* y, double* matrix);

  System& system_;
  Derivatives derivatives_;
  // positions, then velocities of simple joints, 9 variables per spherical joint, forces of actuators and of
  // controlled joints
  std::vector<JointVariable> variables_;
  std::vector<int> force_variable_;  // per actuator
  std::vector<double> columns_, qdd_, tau_, change_;
};

}  // namespace redysim
