#pragma once

#include <cstddef>

#include "model/controller.hpp"

namespace redysim {

// Sampled control: torques are computed at the instants origin + k period, act `delay` later and are held
// until the next ones. The memory belongs to the caller and is zero at the start. It holds the origin (the
// first instant), the numbers of samples and of arrivals, the held torques, and the delayed torques.
class Sampler {
 public:
  // `law_before`: until the first torques arrive, the law itself acts instead of zero torques.
  Sampler(const Controller& controller, bool law_before);

  bool is_active() const { return period_ > 0; }  // otherwise the functions below are not used
  std::size_t memory_size() const { return is_active() ? begin_ + (1 + slots_) * joints_ : 0; }

  // Whether the held torques act; otherwise the law acts directly.
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
