#include "dynamics/straight_line/taylor_series.hpp"

#include <algorithm>

#include "dynamics/clones.hpp"

namespace redysim {
namespace {

// Horner's scheme for a polynomial and its derivative
REDYSIM_INLINE void evaluate_lane(const Lanes<double>* coefficients, std::size_t width, int order, double s,
                                  Lanes<double>& value, Lanes<double>& rate) {
  value = coefficients[static_cast<std::size_t>(order) * width];
  rate = Lanes<double>::all(0);
  for (int k = order - 1; k >= 0; --k) {
    rate = s * rate + value;
    value = s * value + coefficients[static_cast<std::size_t>(k) * width];
  }
}

}  // namespace

TaylorSeries::TaylorSeries(const Plan<double>& plan, int state_size, int highest_order)
    : plan_(plan),
      size_(static_cast<std::size_t>(state_size)),
      state_lanes_(lanes_for(size_)),
      slope_(size_),
      reciprocals_(series_quotients),
      coefficients_((static_cast<std::size_t>(highest_order) + 1) * state_lanes_, Lanes<double>::all(0)),
      left_((static_cast<std::size_t>(highest_order) + 1) * series_lanes, Lanes<double>::all(0)),
      right_(left_) {
  for (int k = 0; k <= highest_order; ++k) per_order_.push_back(1.0 / k);
}

bool TaylorSeries::set_slope(const double* state, const double* forces) {
  const double* qd = state + plan_.nv;
  std::copy_n(qd, plan_.nv, slope_.begin());
  series_values(plan_, state, qd, forces, numbers(left_, 0, 0), numbers(right_, 0, 0), reciprocals_.data(),
                &slope_[static_cast<std::size_t>(plan_.nv)]);
  double sum = 0;
  for (double value : slope_) sum += value * 0.0;
  return sum == 0;
}

void TaylorSeries::start(const double* state, double unit) {
  unit_ = unit;
  order_ = 1;
  std::copy_n(state, size_, numbers(coefficients_, 0, state_lanes_));
  double* first = numbers(coefficients_, 1, state_lanes_);
  for (std::size_t i = 0; i < size_; ++i) first[i] = unit * slope_[i];
}

void TaylorSeries::extend(const double* forces) {
  const double* per_order = &per_order_[static_cast<std::size_t>(order_)];
  series_terms(plan_,
               {static_cast<std::size_t>(order_), per_order[0], unit_ * per_order[1], left_.data(),
                right_.data(), reciprocals_.data(), numbers(coefficients_, order_, state_lanes_)},
               forces);
  ++order_;
}

void TaylorSeries::evaluate(double time, double* state, double* slope) const {
  const double per_unit = 1 / unit_, s = per_unit * time;
  fastest([&] {
    for (std::size_t lane = 0; lane < state_lanes_; ++lane) {
      Lanes<double> value, rate;
      evaluate_lane(&coefficients_[lane], state_lanes_, order_, s, value, rate);
      for (std::size_t k = 0; k < 4 && 4 * lane + k < size_; ++k) {
        state[4 * lane + k] = value[static_cast<int>(k)];
        slope[4 * lane + k] = per_unit * rate[static_cast<int>(k)];
      }
    }
  });
}

void TaylorSeries::restore(int order, double unit, const double* coefficients) {
  order_ = order;
  unit_ = unit;
  std::copy_n(coefficients, room(), numbers(coefficients_, 0, 0));
}

}  // namespace redysim
