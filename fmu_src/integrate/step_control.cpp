#include "integrate/step_control.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace redysim {
namespace {

constexpr double safety = 0.9;      // aims at safety^error_order of the tolerance
constexpr double growth = 6;        // per step
constexpr double reduction = 0.15;  // per step
constexpr double stretch = 1.02;    // a step may be this much longer where that saves one
constexpr double smallest_error = 1e-9;

}  // namespace

StepControl::StepControl(int error_order, double max_step)
    : integral_(0.7 / error_order), proportional_(0.4 / error_order), plain_(1.0 / error_order),
      max_step_(max_step > 0 ? max_step : std::numeric_limits<double>::max()) {}

void StepControl::accepted(double h, double error) {
  error = std::max(error, smallest_error);
  const double factor = safety * std::exp(proportional_ * std::log(previous_error_) - integral_ * std::log(error));
  const double proposed = h * std::max(factor, reduction);
  // a short last step tells less than its law promises: growth counts from the longer of h and the wish
  wanted_ = limited(std::min(proposed, std::max(growth * h, wanted_)));
  previous_error_ = error;
}

double StepControl::rejected(double h, double error) {
  const double factor = error >= 0 && std::isfinite(error) ? safety * std::pow(error, -plain_) : 0.25;
  wanted_ = h * std::clamp(factor, reduction, safety);
  return wanted_;
}

double StepControl::step_for(double remaining) const {
  const double parts = std::ceil(remaining / (stretch * wanted_));
  // too many to count: the end is far away
  if (!(parts < 1e6)) return wanted_;
  return limited(parts <= 1 ? remaining : remaining / parts);
}

}  // namespace redysim
