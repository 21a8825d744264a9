#pragma once

#include <vector>

#include "integrate/methods/integrator.hpp"

namespace redysim {

// Model exchange: a master integrates, and this holds the time and the state it has set.
class GivenState final : public Integrator {
 public:
  explicit GivenState(const System& system);

  Outcome start(double time, const double* y) override;  // quaternions are normalised
  void set_state(const double* y) override { y_.assign(y, y + y_.size()); }
  Outcome advance(double end, bool inputs_changed) override;  // impossible
  double time() const override { return time_; }
  const double* state() const override { return y_.data(); }
  const Statistics& statistics() const override { return statistics_; }
  SolverMethod method() const override { return SolverMethod::automatic; }
  const char* name() const override { return "none: model exchange"; }
  void save(std::vector<unsigned char>& bytes) const override;
  bool restore(const unsigned char* bytes, std::size_t size) override;

  double* y() { return y_.data(); }
  void completed_step() { ++steps_; }
  long steps() const { return steps_; }  // completed since the start
  void set_time(double time) { time_ = time; }
  // The largest deviation of the length of a quaternion from 1.
  double stretch() const;
  void normalise() { normalise(layout_, y_.data()); }
  static void normalise(const StateLayout& layout, double* y);
  static bool has_orientations(const StateLayout& layout, const double* y);  // no quaternion is zero

 private:
  const StateLayout layout_;
  double time_ = 0;
  long steps_ = 0;
  std::vector<double> y_;
  Statistics statistics_;
};

}  // namespace redysim
