#include "integrate/methods/table_choice.hpp"

#include <algorithm>
#include <cmath>

#include "integrate/methods/step_control.hpp"

namespace redysim {
namespace {

constexpr double slopes_of_eighth = 13;
constexpr double worth = 1.1;       // times the right-hand sides that the smaller error of order 8 is worth
constexpr double hysteresis = 1.1;  // in favour of the one in use
constexpr long settled = 4;         // steps after which a new method's step size is its own
constexpr long reviewed = 16;       // steps after which a long advance is looked at again
constexpr double restless = 2;      // growth of the step since the last decision
constexpr double oblivion = 0.01;   // what each decision forgets of the learned ratio
constexpr double smallest_gain = 1, largest_gain = 12;

}  // namespace

// local errors C (h/L)^5 = tolerance and C' (h/L)^8 = tolerance: h8/h5 ~ tolerance^(1/8 - 1/5); the factor is
// that of KR5, gripper and four-bar
TableChoice::TableChoice(double rtol) : expected_(1.6 * std::pow(1e4 * rtol, -0.07)), gain_(expected_) {}

void TableChoice::forget() {
  gain_ = expected_;
  eighth_ = learning_ = 0;
  wanted_before_ = 0;
}

long TableChoice::steps_until_decision() const {
  return learning_ != 0 || wanted_before_ == 0 ? settled : reviewed;
}

void TableChoice::learn(const Situation& now) {
  if (learning_ != 0 && now.steps >= steps_before_ + settled) {
    const double measured = eighth_ != 0 ? now.wanted / step_before_ : step_before_ / now.wanted;
    gain_ = std::clamp(std::sqrt(gain_ * measured), smallest_gain, largest_gain);
    learning_ = 0;
  }
  gain_ += oblivion * (expected_ - gain_);
}

void TableChoice::decide(const Situation& now, double& factor) {
  factor = 1;
  learn(now);
  // a step size on its way to another says nothing of the motion
  const bool calm = now.wanted < restless * wanted_before_ && wanted_before_ < restless * now.wanted;
  wanted_before_ = now.wanted;
  if (!calm) return;
  const double fifth_step = std::min(eighth_ != 0 ? now.wanted / gain_ : now.wanted, now.longest);
  const double eighth_step = std::min(eighth_ != 0 ? now.wanted : now.wanted * gain_, now.longest);
  const double parts = StepControl::parts_of(now.remaining, fifth_step);
  const double fifth_cost = now.slopes_a_step * parts + now.first_slope;
  const double eighth_cost = slopes_of_eighth * StepControl::parts_of(now.remaining, eighth_step);
  const bool better = eighth_cost <= worth * (eighth_ != 0 ? hysteresis : 1 / hysteresis) * fifth_cost;
  if (better == eighth()) return;
  factor = better ? gain_ : 1 / gain_;
  eighth_ = better;
  learning_ = 1;
  step_before_ = now.wanted;
  wanted_before_ = factor * now.wanted;
  steps_before_ = now.steps;
}

void TableChoice::put(StateWriter& writer) const {
  writer.put(gain_);
  writer.put(eighth_);
  writer.put(learning_);
  writer.put(step_before_);
  writer.put(wanted_before_);
  writer.put(steps_before_);
}

bool TableChoice::get(StateReader& reader) {
  TableChoice read = *this;
  reader.get(read.gain_);
  reader.get(read.eighth_);
  reader.get(read.learning_);
  reader.get(read.step_before_);
  reader.get(read.wanted_before_);
  reader.get(read.steps_before_);
  const bool possible = read.gain_ >= smallest_gain && read.gain_ <= largest_gain && read.eighth_ <= 1 &&
                        read.learning_ <= 1 && read.wanted_before_ >= 0 &&
                        (read.learning_ == 0 || read.step_before_ > 0);
  if (!reader.finished() || !possible) return false;
  *this = read;
  return true;
}

}  // namespace redysim
