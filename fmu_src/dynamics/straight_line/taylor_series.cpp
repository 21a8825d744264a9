#include "dynamics/straight_line/taylor_series.hpp"

#include <algorithm>

#include "dynamics/clones.hpp"

namespace redysim {
namespace {

constexpr std::size_t block = 4;  // lanes whose sums stay in registers

std::size_t lanes_for(std::size_t numbers) { return (numbers + 3) / 4; }

// sums = sum of left_j right_(order - j) over 0 < j < order, for Count lanes of rows of `width`
template <std::size_t Count>
REDYSIM_INLINE void sum_block(const Lanes<double>* left, const Lanes<double>* right, std::size_t width,
                              std::size_t order, Lanes<double>* sums) {
  Lanes<double> sum[Count];
  for (auto& lane : sum) lane = Lanes<double>::all(0);
  for (std::size_t j = 1; j < order; ++j)
    for (std::size_t k = 0; k < Count; ++k)
      sum[k] = sum[k] + left[j * width + k] * right[(order - j) * width + k];
  for (std::size_t k = 0; k < Count; ++k) sums[k] = sum[k];
}

REDYSIM_INLINE void sum_products(const Lanes<double>* left, const Lanes<double>* right, std::size_t width,
                                 std::size_t order, Lanes<double>* sums) {
  std::size_t at = 0;
  for (; at + block <= width; at += block) sum_block<block>(left + at, right + at, width, order, sums + at);
  for (; at < width; ++at) sum_block<1>(left + at, right + at, width, order, sums + at);
}

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
      product_lanes_(lanes_for(series_products)),
      slope_(size_),
      reciprocals_(series_quotients),
      coefficients_((static_cast<std::size_t>(highest_order) + 1) * state_lanes_, Lanes<double>::all(0)),
      left_((static_cast<std::size_t>(highest_order) + 1) * product_lanes_, Lanes<double>::all(0)),
      right_(left_),
      sums_(product_lanes_) {
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

void TaylorSeries::set_sums() {
  const std::size_t order = static_cast<std::size_t>(order_);
  fastest([&] { sum_products(left_.data(), right_.data(), product_lanes_, order, sums_.data()); });
}

void TaylorSeries::extend(const double* forces) {
  set_sums();
  const double* q = coefficient(order_);
  const double* qd = q + plan_.nv;
  double* next = numbers(coefficients_, order_ + 1, state_lanes_);
  const double* per_order = &per_order_[static_cast<std::size_t>(order_)];
  const double factor = unit_ * per_order[1];
  for (int i = 0; i < plan_.nv; ++i) next[i] = factor * qd[i];
  series_terms(plan_, order_, per_order[0], factor, q, qd, forces, numbers(sums_, 0, 0), numbers(left_, 0, 0),
               numbers(right_, 0, 0), reciprocals_.data(), numbers(left_, order_, product_lanes_),
               numbers(right_, order_, product_lanes_), next + plan_.nv);
  ++order_;
}

void TaylorSeries::evaluate(double time, double* state, double* slope) const {
  const double s = time / unit_;
  fastest([&] {
    for (std::size_t lane = 0; lane < state_lanes_; ++lane) {
      Lanes<double> value, rate;
      evaluate_lane(&coefficients_[lane], state_lanes_, order_, s, value, rate);
      for (std::size_t k = 0; k < 4 && 4 * lane + k < size_; ++k) {
        state[4 * lane + k] = value[static_cast<int>(k)];
        slope[4 * lane + k] = rate[static_cast<int>(k)] / unit_;
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
