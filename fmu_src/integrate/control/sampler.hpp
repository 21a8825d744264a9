#pragma once

#include <cstddef>

#include "model/controller.hpp"

namespace redysim {

// Sampled control: torques are computed at the instants origin + k period, act `delay` later and are held
// until the next ones. The memory belongs to the caller, zeros at the start: the origin (the first instant),
// the numbers of samples and of arrivals, the held torques, and the torques on their way.
class Sampler {
 public:
  // `law_before`: the law itself acts until the first torques arrive, not 0.
  Sampler(const Controller& controller, bool law_before);

  bool is_active() const { return period_ > 0; }  // else nothing below is used
  std::size_t memory_size() const { return is_active() ? begin_ + (1 + slots_) * joints_ : 0; }

  // Whether the held torques act; otherwise the law does.
  bool holds(const double* memory) const { return is_active() && (memory[samples_] > 0 || !law_before_); }
  const double* held(const double* memory) const { return memory + begin_; }

  bool is_due(double time, const double* memory) const;
  void sample(double time, const double* torques, double* memory) const;
  bool arrive(double time, double* memory) const;  // whether the held torques changed
  // The next instant of a sample or an arrival, s; infinity: none.
  double next_instant(double time, const double* memory) const;

 private:
  enum Place { origin_, samples_, arrivals_, begin_ };
  double last_index(double time, double first) const;
  double after(double time, double first) const;
  std::size_t slot(double index) const;

  double period_, delay_;
  std::size_t joints_, slots_;
  bool law_before_;
};

}  // namespace redysim
