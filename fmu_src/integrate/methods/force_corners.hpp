#pragma once

#include <cstdint>
#include <vector>

#include "integrate/system/system.hpp"

// Corners: narrow regions, shorter than one or two steps of order 5, in which forces change. They occur at
// stops, reversals against dry friction, backlash, actuator limits and contacts. An error estimate of order 8
// can miss a corner within its step.

namespace redysim {

// Kinds of corners, as bits.
struct Corners {
  static constexpr unsigned stops = 1, friction = 2, backlash = 4;
  static constexpr unsigned of_state = stops | friction | backlash;  // steps of order 8 are often rejected
  static constexpr unsigned of_evaluation = 8;                       // contacts and limits of actuators
  static constexpr unsigned jumps = 16;                              // contacts of ReDySim's law
};
unsigned corners_of(const System& system);

// Time, s, until a joint reaches a corner of its stop or friction force, at constant accelerations; infinity:
// never. `slope`: time derivative of the state y.
double time_to_corner(const System& system, const double* y, const double* slope);

// Detects whether a step crosses a corner. Stages count, too: a corner may be entered and left within a step.
class CornerWatch {
 public:
  explicit CornerWatch(const System& system) : begin_y_(static_cast<std::size_t>(system.size())) {}

  // Begins a step at this state, of the last right-hand side or search for contacts.
  void begin(System& system, double time, const double* y);
  // Whether time_of_short_touch may find one: there are stops, friction or backlash.
  bool expects_touches() const { return (kinds_ & Corners::of_state) != 0; }
  // Whether the forces of ReDySim's contact law jump between the start of the step and the last right-hand
  // side.
  bool jumps(const System& system) const {
    return (kinds_ & Corners::jumps) != 0 && system.contact_regions() != contacts_;
  }
  double begin_time() const { return begin_time_; }
  const double* begin_state() const { return begin_y_.data(); }
  // Begins an attempt of this step.
  void attempt() { crosses_ = noted_ = false; }
  // Notes a stage of the attempt; call it after the right-hand side.
  void note(System& system, double time, const double* y);
  // Whether the attempt, which ends at this state, crosses a corner.
  bool crosses(System& system, double time, const double* y) const;
  // Time at which a joint is deepest in a stop or in a reversal against friction, or a coupling or gear
  // beyond the end of its play, if it reaches and leaves it within the step to this state, by the cubic
  // polynomial through positions and velocities; infinity: none does. `weights` of the state: a depth in a
  // stop or reversal below the tolerance does not count.
  double time_of_short_touch(System& system, double time, const double* y, const double* weights) const;

 private:
  bool watches() const { return kinds_ != 0; }
  unsigned kinds_ = 0;  // of corners
  double begin_time_ = 0;
  std::vector<double> begin_y_;
  bool noted_ = false, crosses_ = false;
  // Codes of the regions between the corners: of_state_ and those of contacts at the start of the step, those
  // of actuator limits in the first stage.
  std::uint64_t of_state_ = 0, contacts_ = 0, limits_ = 0;
};

}  // namespace redysim
