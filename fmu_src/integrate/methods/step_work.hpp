#pragma once

#include "integrate/methods/state_bytes.hpp"

namespace redysim {

// The work at and between the ends of the steps of a multistep method. It is not part of the error test,
// since energy outputs must not change a run. If the method's error estimate of the work is too large for a
// step, Gauss-Legendre quadrature of the power along the dense output replaces the increment.
class StepWork {
 public:
  using Power = bool (*)(double time, void* owner, double& power);  // false: it cannot be computed

  void start() { *this = {}; }
  void begin(double work);  // work at the start of the method

  // After a step from `from` to `to`. `work`: by the method, `error`: its estimate, `rtol`: tolerance of the
  // work.
  void step(double from, double to, double work, double error, double rtol, Power power, void* owner);
  double at(double time, double work) const;  // within the last step; `work`: by the method
  double end() const { return end_; }

  void put(ByteWriter& writer) const;
  void get(ByteReader& reader);

 private:
  template <class Self, class Visit>
  static void each_part(Self& self, const Visit& visit);  // that is saved

  static constexpr int nodes = 6;
  double integral(double x) const;  // of the power's polynomial from -1, over half the step

  double from_ = 0, to_ = 0;
  double begin_ = 0, end_ = 0;    // work at from_ and to_
  double offset_ = 0;             // correction of the method's work
  double moved_ = 0;              // sum of |increments|
  unsigned char integrated_ = 0;  // whether the last step was
  double coefficients_[nodes]{};  // of Legendre polynomials: the power over the last step
};

}  // namespace redysim
