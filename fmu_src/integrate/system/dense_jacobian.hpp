#pragma once

#include <vector>

#include "dynamics/derivatives.hpp"
#include "integrate/system/system.hpp"

namespace redysim {

// d(ydot)/dy of a system, exact (dynamics/derivatives.hpp). Owned by the implicit methods alone.
class DenseJacobian {
 public:
  explicit DenseJacobian(System& system);

  // Fills `matrix`, columns of length System::size() one after the other. Costs about a right-hand side for
  // each column, and one by itself, which counts as an evaluation.
  Status evaluate(double time, const double* y, double* matrix);

 private:
  const double* column(int variable) const {
    return &columns_[static_cast<std::size_t>(variable) * change_.size()];
  }
  void add_rows(const double* change, double* column) const;
  void set_ball(int ball, const double* y, double* matrix);

  System& system_;
  Derivatives derivatives_;
  std::vector<int> variables_;  // simple joints' positions, their velocities, then 9 a spherical joint
  std::vector<double> columns_, qdd_, tau_, change_;
};

}  // namespace redysim
