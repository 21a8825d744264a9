#pragma once

#include "integrate/methods/state_bytes.hpp"

namespace redysim {

// The work at and within the steps of a multistep method. It is not part of the error test, since energy
// outputs must not change a run. If the method's error estimate of the work is too large for a step, its
// increment is replaced by Gauss-Legendre quadrature of the power along the dense output. The quadrature
// proceeds in parts of the step, only as far as requested: the power may be meaningless in the rest of a long
// step that a breakpoint of a trajectory will end.
class StepWork {
 public:
  static constexpr int nodes = 6;  // of the quadrature
  struct Power {
    bool (*function)(double time, void* owner, int part, double& power);  // false: it cannot be computed
    void* owner;
    int part;  // 0: total, 1: contacts
  };

  void start() { *this = {}; }
  void begin(double work);  // work at the start of the method

  // After a step from `from` to `to`. `work` and `error`: computed by the method. `rtol`: relative tolerance
  // of the work. Returns whether quadrature follows; set its `rounding` error then, J.
  bool step(double from, double to, double work, double error, double rtol);
  void set_rounding(double rounding) { rounding_ = rounding; }
  // Work at a time within the last step; times must not decrease. `work`: computed by the method.
  double at(double time, double work, const Power& power);
  // Work at the end of the last step. Required before the next step.
  double end(const Power& power);

  void put(ByteWriter& writer) const;
  void get(ByteReader& reader);

 private:
  template <class Self, class Visit>
  static void each_part(Self& self, const Visit& visit);  // visits each saved member

  // Bisections in a step: a power of rounding errors, for example of a contact between bodies that loops
  // lock, is not smooth.
  static constexpr int most_bisections = 200;
  bool fit(const Power& power);  // sets coefficients_ for the part; false: not accurate
  void next_part(const Power& power);
  double integral(double x) const;  // of the power's polynomial from -1 to x, per half part

  double from_ = 0, to_ = 0;      // the part of the last step that is integrated
  double step_end_ = 0;           // end of the last step
  double begin_ = 0, end_ = 0;    // work at from_ and to_
  double method_end_ = 0;         // work at step_end_, computed by the method
  double offset_ = 0;             // correction of the method's work
  double moved_ = 0;              // sum of |increments|
  double rtol_ = 0;               // of the last step
  double rounding_ = 0;           // of the last step with quadrature
  std::int32_t bisections_ = 0;   // in the last step
  unsigned char integrated_ = 0;  // 1: the last step uses quadrature
  double coefficients_[nodes]{};  // Legendre coefficients of the power in the part
};

}  // namespace redysim
