#include "integrate/methods/step_control.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace redysim {
namespace {

constexpr double safety = 0.9;      // aims at safety^error_order of the tolerance
constexpr double growth = 6;        // per step
constexpr double reduction = 0.15;  // per step
constexpr double stretch = 1.02;    // a step may be this much longer where that saves one
constexpr double smallest_error = 1e-12;
constexpr double remembered = 1e-4;  // smallest error that the controller remembers
constexpr double telling = 1e-4;     // an error below it, of a step cut short, may be rounding

}  // namespace

StepControl::StepControl(int error_order, double max_step)
    : max_step_(max_step > 0 ? max_step : std::numeric_limits<double>::max()) {
  set_error_order(error_order);
}

void StepControl::set_error_order(int error_order) {
  integral_ = 0.85 / error_order;
  proportional_ = 0.2 / error_order;
  plain_ = 1.0 / error_order;
}

void StepControl::accepted(double h, double error) {
  // error^-integral, the last error^proportional and the limits of the factor
  const double law = std::exp(proportional_ * std::log(previous_error_) -
                              integral_ * std::log(std::max(error, smallest_error)));
  const double proposed = h * std::max(safety * law, reduction);
  // growth counts from the longer of this step and the wish, so that no error at all stays bounded
  const double next = std::min(proposed, std::max(growth * h, wanted_));
  const bool tells_nothing = h < 0.5 * wanted_ && error < telling;
  wanted_ = limited(tells_nothing ? std::max(next, wanted_) : next);
  previous_error_ = std::max(error, remembered);
}

double StepControl::rejected(double h, double error) {
  const double factor = error >= 0 && std::isfinite(error) ? safety * std::pow(error, -plain_) : 0.25;
  wanted_ = h * std::clamp(factor, reduction, safety);
  return wanted_;
}

double StepControl::parts_of(double remaining, double step) {
  return std::ceil(remaining / (stretch * step));
}

double StepControl::step_for(double remaining) const {
  const double parts = parts_of(remaining, wanted_);
  // too many to count: the end is far away
  if (!(parts < 1e6)) return wanted_;
  return limited(parts <= 1 ? remaining : remaining / parts);
}

}  // namespace redysim
