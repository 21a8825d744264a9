#pragma once

#include <limits>

#include "integrate/methods/state_bytes.hpp"

namespace redysim {

// Chooses between two explicit Runge-Kutta methods, of order 5 (or 3) and order 8: the one with fewer
// right-hand sides in the rest of an advance (constants in tuning.hpp). The step size of the method in use is
// known. That of the other follows from their ratio, which is estimated from the tolerance and corrected at
// each change. The choice depends only on the previous run.
class TableChoice {
 public:
  explicit TableChoice(double rtol, bool over_third = false);  // over_third: the lower order is 3

  void forget();  // restarts with the lower order
  bool eighth() const { return eighth_ != 0; }

  struct Situation {
    double remaining;           // length of the rest of the advance, s
    double wanted;              // step size allowed by the tolerance, method in use, s
    double step_limit;          // user's limit, s
    std::int64_t steps;         // accepted steps, from any origin
    double first_slope;         // right-hand sides for the first slope, lower order
    double slopes_a_step;       // right-hand sides of a step, lower order
    bool may_pass_end = false;  // order 8 may pass the end of the advance in its last step
    // Corners of forces. Order 8 is then used for intervals much shorter than its steps, for tight tolerances
    // and, if only stops have corners, far from them.
    bool has_corners = false, has_only_stops = false;
    double smooth_for = std::numeric_limits<double>::infinity();  // until the next corner, s
    double affordable = std::numeric_limits<double>::infinity();  // right-hand sides left
  };
  // Updates the choice. Multiply the step size by `factor` afterwards.
  void decide(const Situation& now, double& factor);

  long steps_until_decision() const;  // number of steps

  double gain() const { return gain_; }  // step size of order 8 relative to the lower order

  void put(ByteWriter& writer) const;
  bool get(ByteReader& reader);  // false: invalid

 private:
  void learn(const Situation& now);
  template <class Self, class Visit>
  static void each_part(Self& self, const Visit& visit);  // of the saved members

  bool is_tight_;    // tight tolerance
  double expected_;  // gain_ expected from the tolerance
  double gain_;
  unsigned char eighth_ = 0, learning_ = 0;
  double step_before_ = 0;         // step size of the previous method, s
  double wanted_before_ = 0;       // step size at the last decision, s; 0: none
  std::int64_t steps_before_ = 0;  // steps at the last change
};

}  // namespace redysim
