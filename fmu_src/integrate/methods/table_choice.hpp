#pragma once

#include "integrate/system/state_bytes.hpp"

namespace redysim {

// Which of two explicit Runge-Kutta methods serves an advance, order 5 or order 8: the cheaper one, by the
// steps that each would take. The method in use knows its own step; the other's follows from the ratio of
// both, which is guessed from the tolerance and learned at each change. Depends
// on nothing but the run so far.
class TableChoice {
 public:
  explicit TableChoice(double rtol);

  void forget();  // order 5 begins
  bool eighth() const { return eighth_ != 0; }

  struct Situation {
    double remaining;      // s, of the advance
    double wanted;         // s, step of the method in use
    double longest;        // s, allowed by the user
    long steps;            // accepted so far, counted from anywhere
    double first_slope;    // right-hand sides of order 5 beyond 6 a step: for the first
    double slopes_a_step;  // of order 5
  };
  // Decides; `factor` is what the step is to be multiplied by.
  void decide(const Situation& now, double& factor);

  long steps_until_decision() const;  // in a long advance

  double gain() const { return gain_; }  // step of order 8 over that of order 5

  void put(StateWriter& writer) const;
  bool get(StateReader& reader);  // false: no such choice

 private:
  void learn(const Situation& now);

  double expected_;  // gain
  double gain_;
  unsigned char eighth_ = 0, learning_ = 0;
  double step_before_ = 0;         // s, of the method that was left last
  double wanted_before_ = 0;       // s, at the last decision; 0: none
  std::int64_t steps_before_ = 0;  // when it was left
};

}  // namespace redysim
