#pragma once

#include <limits>

#include "integrate/methods/state_bytes.hpp"

namespace redysim {

// Chooses between two explicit Runge-Kutta methods, order 5 (or 3) and order 8, the one with fewer right-hand
// sides in the rest of an advance (constants in tuning.hpp). The step size of the method in use is known.
// That of the other follows from their ratio, which is estimated from the tolerance and corrected at each
// change. The choice depends on the previous run only.
class TableChoice {
 public:
  explicit TableChoice(double rtol, bool over_third = false);  // over_third: the lower order is three

  void forget();  // starts with order 5
  bool eighth() const { return eighth_ != 0; }

  struct Situation {
    double remaining;           // s, of the advance
    double wanted;              // s, step of the method in use
    double step_limit;          // s, by the user
    long steps;                 // accepted so far, from any origin
    double first_slope;         // right-hand sides of order 5 for the slope at the start
    double slopes_a_step;       // of order 5
    bool may_pass_end = false;  // order 8 may pass the end of the advance in its last step
    // Of the forces. Order 8 is then for intervals much shorter than its steps, and for tight tolerances.
    bool has_corners = false;
    double smooth_for = std::numeric_limits<double>::infinity();  // s, until the next
    double affordable = std::numeric_limits<double>::infinity();  // right-hand sides
  };
  // Updates the choice; the step size is to be multiplied by `factor`.
  void decide(const Situation& now, double& factor);

  long steps_until_decision() const;  // in a long advance

  double gain() const { return gain_; }  // step of order 8 over that of order 5

  void put(ByteWriter& writer) const;
  bool get(ByteReader& reader);  // false: invalid

 private:
  void learn(const Situation& now);
  template <class Self, class Visit>
  static void each_part(Self& self, const Visit& visit);  // that is saved

  bool is_tight_;    // the tolerance
  double expected_;  // gain
  double gain_;
  unsigned char eighth_ = 0, learning_ = 0;
  double step_before_ = 0;         // s, of the previous method
  double wanted_before_ = 0;       // s, at the last decision; 0: none
  std::int64_t steps_before_ = 0;  // at the last change
};

}  // namespace redysim
