#pragma once

#include "integrate/system/state_bytes.hpp"

namespace redysim {

// The work at and between the ends of a multistep method's steps. It is not under the error test, since
// asking for energies must not change a run: where the method's own estimate says that a step integrated it
// too coarsely, Gauss-Legendre quadrature of the power along the method's dense output replaces the
// increment.
class StepWork {
 public:
  using Power = bool (*)(double time, void* owner, double& power);  // false: it cannot be computed

  void start() { *this = {}; }
  void begin(double work);  // the method begins at this work

  // A step from `from` to `to` ended at `work` by the method; `error`: its estimate, `rtol`: that of the
  // work.
  void step(double from, double to, double work, double error, double rtol, Power power, void* owner);
  double at(double time, double work) const;  // within the last step; `work`: by the method
  double end() const { return end_; }

  void put(StateWriter& writer) const;
  void get(StateReader& reader);

 private:
  static constexpr int nodes = 6;
  double integral(double x) const;  // of the power's polynomial from -1, over half the step

  double from_ = 0, to_ = 0;
  double begin_ = 0, end_ = 0;    // work at from_ and to_
  double offset_ = 0;             // of the work from the method's
  double moved_ = 0;              // sum of the increments' sizes
  unsigned char integrated_ = 0;  // the last step by quadrature
  double coefficients_[nodes]{};  // of Legendre polynomials: the power over the last step
};

}  // namespace redysim
