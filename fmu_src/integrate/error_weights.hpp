#pragma once

#include <vector>

#include "integrate/system.hpp"

namespace redysim {

// The scale of an acceptable error, component by component: weight = 1 / (rtol |y| + atol).
// * A revolute joint's |q| counts as 2 pi at most: an angle has no scale beyond a turn.
// * The work has weight 0: asking for energies must not change the trajectory. It is integrated by the
//   same formula with the same steps, so its error is of the size of the state's.
class ErrorWeights {
 public:
  ErrorWeights(const System& system, double rtol, double atol);

  void evaluate(const double* y, double* weights) const;          // arrays of System::size()
  double norm(const double* error, const double* weights) const;  // root mean square of weighted entries

 private:
  double rtol_, atol_;
  std::vector<double> cap_;  // largest |y| that counts; one entry a weighted component
  std::size_t size_;
};

}  // namespace redysim
