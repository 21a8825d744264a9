#include "integrate/methods/table_choice.hpp"

#include <algorithm>
#include <cmath>

#include "integrate/methods/step_control.hpp"
#include "integrate/methods/tuning.hpp"

namespace redysim {
namespace {

double possible_ratio(double ratio) {
  return std::clamp(ratio, Tuning::smallest_ratio, Tuning::largest_ratio);
}

}  // namespace

TableChoice::TableChoice(double rtol, bool over_third)
    : is_tight_(rtol <= Tuning::corners_rtol),
      expected_(possible_ratio((over_third ? Tuning::step_ratio_third : Tuning::step_ratio) *
                               std::pow(Tuning::step_ratio_tolerances * rtol, Tuning::step_ratio_exponent))),
      gain_(expected_) {}

void TableChoice::forget() {
  gain_ = expected_;
  eighth_ = learning_ = 0;
  wanted_before_ = 0;
}

long TableChoice::steps_until_decision() const {
  return learning_ != 0 || wanted_before_ == 0 ? Tuning::settling_steps : Tuning::review_steps;
}

void TableChoice::learn(const Situation& now) {
  if (learning_ != 0 && now.steps >= steps_before_ + Tuning::settling_steps) {
    const double measured = eighth_ != 0 ? now.wanted / step_before_ : step_before_ / now.wanted;
    gain_ = possible_ratio(std::cbrt(gain_ * measured * measured));
    learning_ = 0;
  }
  gain_ += Tuning::forgotten * (expected_ - gain_);
}

void TableChoice::decide(const Situation& now, double& factor) {
  factor = 1;
  learn(now);
  // no decision while the step size still changes
  const bool settled = now.wanted < Tuning::settled_growth * wanted_before_ &&
                       wanted_before_ < Tuning::settled_growth * now.wanted;
  wanted_before_ = now.wanted;
  if (!settled) return;
  const double fifth_step = std::min(eighth_ != 0 ? now.wanted / gain_ : now.wanted, now.step_limit);
  const double eighth_step = std::min(eighth_ != 0 ? now.wanted : now.wanted * gain_, now.step_limit);
  const double parts = StepControl::parts_of(now.remaining, fifth_step);
  const double fifth_cost = now.slopes_a_step * parts + now.first_slope;
  const double steps = now.remaining / eighth_step;
  const double eighth_cost =
      now.may_pass_end ? Tuning::eighth_stages * steps + Tuning::polynomial_stages * std::min(1.0, steps)
                       : Tuning::eighth_stages * StepControl::parts_of(now.remaining, eighth_step);
  const double in_favour = eighth_ != 0 ? Tuning::hysteresis : 1 / Tuning::hysteresis;
  const bool is_short = now.remaining < Tuning::short_of_corners * std::min(fifth_step, now.smooth_for);
  const bool is_far = now.has_only_stops && now.smooth_for > Tuning::far_from_stops * eighth_step;
  const bool better = (is_short || is_far || is_tight_ || !now.has_corners) &&
                      now.affordable >= Tuning::eighth_stages &&
                      eighth_cost <= Tuning::accuracy_worth * in_favour * fifth_cost;
  if (better == eighth()) return;
  factor = better ? gain_ : 1 / gain_;
  eighth_ = better;
  learning_ = 1;
  step_before_ = now.wanted;
  wanted_before_ = factor * now.wanted;
  steps_before_ = now.steps;
}

template <class Self, class Visit>
void TableChoice::each_part(Self& self, const Visit& visit) {
  visit(self.gain_);
  visit(self.eighth_);
  visit(self.learning_);
  visit(self.step_before_);
  visit(self.wanted_before_);
  visit(self.steps_before_);
}

void TableChoice::put(ByteWriter& writer) const {
  each_part(*this, [&writer](const auto& part) { writer.put(part); });
}

bool TableChoice::get(ByteReader& reader) {
  TableChoice read = *this;
  each_part(read, [&reader](auto& part) { reader.get(part); });
  const bool possible = read.gain_ == possible_ratio(read.gain_) && read.eighth_ <= 1 &&
                        read.learning_ <= 1 && read.wanted_before_ >= 0 &&
                        (read.learning_ == 0 || read.step_before_ > 0);
  if (!reader.finished() || !possible) return false;
  *this = read;
  return true;
}

}  // namespace redysim
