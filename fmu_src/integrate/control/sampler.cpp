#include "integrate/control/sampler.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "integrate/control/reference.hpp"

namespace redysim {

// Slots for delayed torques: one per sample within the delay, one for the present sample, and one for a
// sample that is early by rounding.
Sampler::Sampler(const Controller& controller, bool law_before)
    : period_(controller.sample_time),
      delay_(controller.delay),
      joints_(controller.joints.size()),
      slots_(period_ > 0 ? static_cast<std::size_t>(delay_ / period_) + 2 : 0),
      law_before_(law_before || delay_ == 0) {}

// Instants are counted from the first one, so that they do not drift.
double Sampler::last_index(double time, double first) const {
  return std::floor((passed(time) - first) / period_);
}

double Sampler::after(double time, double first) const {
  const double instant = first + std::max(0.0, last_index(time, first) + 1) * period_;
  return instant > time ? instant : std::numeric_limits<double>::infinity();
}

std::size_t Sampler::slot(double index) const {
  const double place = std::fmod(index, static_cast<double>(slots_));
  return begin_ + joints_ * (1 + (place > 0 ? static_cast<std::size_t>(place) : 0));
}

bool Sampler::is_due(double time, const double* memory) const {
  return !(memory[samples_] > 0) || last_index(time, memory[origin_]) >= memory[samples_];
}

void Sampler::sample(double time, const double* torques, double* memory) const {
  const bool first = !(memory[samples_] > 0);
  if (first) memory[origin_] = time;
  const double index = first ? 0 : last_index(time, memory[origin_]);
  std::copy_n(torques, joints_, memory + slot(index));
  if (first && law_before_) std::copy_n(torques, joints_, memory + begin_);
  memory[samples_] = index + 1;
}

bool Sampler::arrive(double time, double* memory) const {
  const double index = last_index(time, memory[origin_] + delay_);
  if (!(index >= 0) || index < memory[arrivals_]) return false;
  memory[arrivals_] = index + 1;
  const double* torques = memory + slot(index);
  if (std::equal(torques, torques + joints_, memory + begin_)) return false;
  std::copy_n(torques, joints_, memory + begin_);
  return true;
}

// An arrival that differs from a sample only by rounding belongs to that sample.
double Sampler::next_instant(double time, const double* memory) const {
  const double sample = after(time, memory[origin_]), arrival = after(time, memory[origin_] + delay_);
  return passed(arrival) < sample ? arrival : sample;
}

}  // namespace redysim
