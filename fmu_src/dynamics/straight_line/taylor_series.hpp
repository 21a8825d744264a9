#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "dynamics/plan.hpp"
#include "math/lanes.hpp"

namespace redysim {

inline double* numbers(Lanes<double>* lanes) { return reinterpret_cast<double*>(lanes); }

// Inputs and storage of the terms of one order of a series.
struct SeriesOrder {
  std::size_t order;
  double per_order, factor;    // 1 / order, unit / (order + 1)
  Lanes<double>*left, *right;  // factors of the products, series_lanes per order
  const double* reciprocals;   // reciprocals of the divisors' coefficients of order 0
  double* state;               // coefficients of this order, followed by the next order
};

// Only in a library built for a scene with method taylor (series_statements.hpp): numbers of products, in
// lanes of 4, and of divisions, and the recursion. `slope`: qdd, then the power if the scene has energies.
extern const std::size_t series_lanes, series_quotients;
void series_values(const Plan<double>& plan, const double* q, const double* qd, const double* tau,
                   double* left, double* right, double* reciprocals, double* slope);
void series_terms(const Plan<double>& plan, const SeriesOrder& at, const double* tau);

// sums = sum of left_j right_(order - j) over 0 < j < order, for lanes K of rows of Width; order > 1.
template <std::size_t Width, std::size_t... K>
REDYSIM_INLINE void sum_lanes(const Lanes<double>* left, const Lanes<double>* right, std::size_t order,
                              double* sums, std::index_sequence<K...>) {
  Lanes<double> sum[] = {left[Width + K] * right[(order - 1) * Width + K]...};
  for (std::size_t j = 2; j < order; ++j)
    ((sum[K] = sum[K] + left[j * Width + K] * right[(order - j) * Width + K]), ...);
  ((reinterpret_cast<Lanes<double>*>(sums)[K] = sum[K]), ...);
}

template <std::size_t Width>
REDYSIM_INLINE void sum_products(const Lanes<double>* left, const Lanes<double>* right, std::size_t order,
                                 double* sums) {
  constexpr std::size_t block = 4, rest = Width % block;  // number of lanes whose sums stay in registers
  if (order == 1) {
    std::fill_n(sums, 4 * Width, 0.0);
    return;
  }
  std::size_t at = 0;
  for (; at + block <= Width; at += block)
    sum_lanes<Width>(left + at, right + at, order, sums + 4 * at, std::make_index_sequence<block>());
  if constexpr (rest > 0)
    sum_lanes<Width>(left + at, right + at, order, sums + 4 * at, std::make_index_sequence<rest>());
}

// Taylor series of a motion of the library's scene, in s = time / unit from its start. State: [q; qd; work];
// work of inputs and dampers only with energies.
class TaylorSeries {
 public:
  TaylorSeries(const Plan<double>& plan, int state_size, int highest_order);

  // Computes the slope of a state, per s, for joint forces (nv). False: not finite.
  bool set_slope(const double* state, const double* forces);
  const double* slope() const { return slope_.data(); }

  void start(const double* state, double unit);  // order 1; call after set_slope of the same state
  void extend(const double* forces);             // adds one order; forces: coefficients of order order()
  int order() const { return order_; }
  double unit() const { return unit_; }
  const double* coefficient(int order) const { return numbers(coefficients_, order, state_lanes_); }

  // State and its slope, per s, at `time` s from the start.
  void evaluate(double time, double* state, double* slope) const;

  // The coefficients of all orders, for saved states.
  std::size_t room() const { return 4 * coefficients_.size(); }
  const double* saved() const { return coefficient(0); }
  void restore(int order, double unit, const double* coefficients);

 private:
  using Rows = std::vector<Lanes<double>>;  // rows of all orders

  static double* numbers(Rows& rows, int order, std::size_t width) {
    return redysim::numbers(rows.data() + static_cast<std::size_t>(order) * width);
  }
  static const double* numbers(const Rows& rows, int order, std::size_t width) {
    return reinterpret_cast<const double*>(rows.data() + static_cast<std::size_t>(order) * width);
  }

  const Plan<double>& plan_;
  std::size_t size_, state_lanes_;
  int order_ = 0;
  double unit_ = 1;
  std::vector<double> slope_, reciprocals_;
  Rows coefficients_, left_, right_;
  std::vector<double> per_order_;  // 1 / k, for k up to the highest order
};

}  // namespace redysim
