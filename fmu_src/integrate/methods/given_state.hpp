#pragma once

#include <cstdint>
#include <vector>

#include "integrate/methods/integrator.hpp"
#include "integrate/system/independent_coordinates.hpp"
#include "integrate/system/start.hpp"

namespace redysim {

// Model exchange: the master integrates. This class holds the time and the states that it sets: entries of
// y and independent coordinates. The other entries of y are those at the last completed step, or at a later
// state (see close).
class GivenState final : public Integrator {
 public:
  GivenState(const System& system, IndependentCoordinates& independent);

  Outcome start(double time, const double* y) override;  // quaternions are normalised
  void set_state(const double* y) override;
  Outcome advance(double end, bool inputs_changed) override;  // not supported: returns a failure
  double time() const override { return time_; }
  const double* state() const override { return y_.data(); }
  const Statistics& statistics() const override { return statistics_; }
  SolverMethod method() const override { return SolverMethod::automatic; }
  const char* name() const override { return "none: model exchange"; }
  void save(std::vector<unsigned char>& bytes) const override;
  bool restore(const unsigned char* bytes, std::size_t size) override;

  void get(double* states) const;
  bool set(const double* states);  // false: a quaternion would be zero
  // Projects y, state() on entry, onto the constraints, along a path from the last completed step or, if this
  // is far, from the last state that was. False: not possible. If the master completes no steps, y replaces
  // the stored state there, and the state of the last event is tried, too.
  bool close(double time, double* y);
  bool is_far() const { return is_far_; }  // the last `close` needed several moves from the completed step
  void keep(const double* y);              // replaces the stored state by one that satisfies the constraints
  void completed_step(const double* y) {
    completes_steps_ = 1;
    keep(y);
  }
  void choose();  // chooses independent coordinates at the last completed step
  void set_time(double time) { time_ = time; }
  // Maximum deviation of a quaternion's norm from 1.
  double stretch() const;
  void normalise() { normalise_quaternions(layout_, y_.data()); }
  static bool has_orientations(const StateLayout& layout, const double* y);  // has_orientation of each

 private:
  // A configuration from which loops are closed: entries of y in clusters, and values of
  // IndependentCoordinates::driven.
  struct Start {
    std::vector<double> dependent, driven;
  };
  Start start_at(double time, const double* y) const;
  bool close_from(const Start& start, double time, double* y);
  void follow(const double* y);  // y satisfies the constraints and replaces the stored state

  const StateLayout layout_;
  double time_ = 0;
  IndependentCoordinates& coordinates_;
  std::vector<double> y_, independent_;  // independent_: positions, then velocities
  std::uint8_t completes_steps_ = 0;     // 1: the master does
  bool is_far_ = false;
  // The stored state; the last one far from it, without completed steps that of the last event, or the same.
  Start completed_, far_;
  Statistics statistics_;
};

}  // namespace redysim
