#include "integrate/methods/step_control.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace redysim {
namespace {

// Aims at safety^error_order times the tolerance. At high orders a rejected attempt costs more than a shorter
// step: at equal error, order 8 then takes 5 % fewer right-hand sides (7 models, rtol 1e-4 to 1e-11).
constexpr double safety = 0.9, safety_of_high_order = 0.8;
constexpr int high_order = 8;
constexpr double growth = 6;        // maximum, per step
constexpr double reduction = 0.15;  // minimum factor, per step
constexpr double stretch = 1.02;    // a step may be longer by this factor if that saves one
constexpr double smallest_error = 1e-12;
constexpr double smallest_remembered = 1e-4;   // minimum error kept for the controller
constexpr double smallest_significant = 1e-4;  // of a shortened step; smaller errors may be rounding

}  // namespace

double step_limit(double max_step) {
  return max_step > 0 ? std::max(max_step, std::numeric_limits<double>::min())
                      : std::numeric_limits<double>::max();
}

StepControl::StepControl(int error_order, double max_step) : step_limit_(redysim::step_limit(max_step)) {
  set_error_order(error_order);
}

void StepControl::set_error_order(int error_order) {
  integral_ = 0.85 / error_order;
  proportional_ = 0.2 / error_order;
  plain_ = 1.0 / error_order;
  safety_ = error_order < high_order ? safety : safety_of_high_order;
}

void StepControl::accepted(double h, double error) {
  // previous_error^proportional * error^-integral
  const double law = std::exp(proportional_ * std::log(previous_error_) -
                              integral_ * std::log(std::max(error, smallest_error)));
  const double proposed = h * std::max(safety_ * law, reduction);
  // growth is limited relative to the longer of this step and the previous proposal, also if the error is 0
  const double next = std::min(proposed, std::max(growth * h, wanted_));
  const bool is_insignificant = h < 0.5 * wanted_ && error < smallest_significant;
  wanted_ = limited(is_insignificant ? std::max(next, wanted_) : next);
  previous_error_ = std::max(error, smallest_remembered);
}

double StepControl::rejected(double h, double error) {
  const double factor = error >= 0 && std::isfinite(error) ? safety_ * std::pow(error, -plain_) : 0.25;
  wanted_ = h * std::clamp(factor, reduction, safety_);
  return wanted_;
}

double StepControl::parts_of(double remaining, double step) {
  return std::ceil(remaining / (stretch * step));
}

double StepControl::step_for(double remaining) const {
  const double parts = parts_of(remaining, wanted_);
  // too many parts to count
  if (!(parts < 1e6)) return wanted_;
  return limited(parts <= 1 ? remaining : remaining / parts);
}

}  // namespace redysim
