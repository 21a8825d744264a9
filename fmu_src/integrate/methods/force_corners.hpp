#pragma once

#include <cstdint>

#include "integrate/system/system.hpp"

// Where forces change within one or two steps of order 5: at stops, reversals against dry friction, backlash,
// limits of actuators and contacts. An error estimate of order 8 does not see all of such a corner within its
// step.

namespace redysim {

bool has_backlash(const System& system);
// At stops, reversals and backlash, where steps of order 8 are rejected often.
bool has_corners(const System& system);

// Until a joint comes to a corner of its force by stops or friction, s, with constant accelerations;
// infinity: never. `slope`: of the state y.
double time_to_corner(const System& system, const double* y, const double* slope);

// Finds out whether a step crosses a corner. Stages count, too: a corner may be entered and left within it.
class CornerWatch {
 public:
  // Of a step that starts here.
  void begin(System& system, double time, const double* y);
  // Of an attempt of this step.
  void attempt() { crosses_ = noted_ = false; }
  // A stage of it, after its right-hand side.
  void note(System& system, double time, const double* y);
  // Whether the attempt, which ends here, crosses a corner.
  bool crosses(System& system, double time, const double* y) const;

 private:
  bool watches_ = false, noted_ = false, crosses_ = false;
  // Numbers of the regions between the corners: in which the state is at the start of the step, in which the
  // contacts and limits of actuators were in the first stage.
  std::uint64_t of_state_ = 0, of_evaluation_ = 0;
};

}  // namespace redysim
