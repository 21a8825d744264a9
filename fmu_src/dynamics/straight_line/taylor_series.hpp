#pragma once

#include <cstddef>
#include <vector>

#include "dynamics/plan.hpp"
#include "math/lanes.hpp"

namespace redysim {

// Only in a library built for a scene with method taylor (series_statements.hpp): numbers of sums and
// divisions, and the recursion. `slope`: qdd, then the power if the scene has energies. `next`: the same
// times `factor`.
extern const std::size_t series_products, series_quotients;
void series_values(const Plan<double>& plan, const double* q, const double* qd, const double* tau,
                   double* left, double* right, double* reciprocals, double* slope);
void series_terms(const Plan<double>& plan, double order, double per_order, double factor, const double* q,
                  const double* qd, const double* tau, const double* sums, const double* left_0,
                  const double* right_0, const double* reciprocals, double* left, double* right,
                  double* next);

// Taylor series of a motion of that scene, in s = time / unit from its start. State: [q; qd; work], the work
// of inputs and dampers with energies only.
class TaylorSeries {
 public:
  TaylorSeries(const Plan<double>& plan, int state_size, int highest_order);

  // The slope of a state, per s of time, for forces of the joints (nv). False: not finite.
  bool set_slope(const double* state, const double* forces);
  const double* slope() const { return slope_.data(); }

  void start(const double* state, double unit);  // to order 1, after set_slope of the same state
  void extend(const double* forces);             // by one order; forces: their coefficient of order()
  int order() const { return order_; }
  double unit() const { return unit_; }
  const double* coefficient(int order) const { return numbers(coefficients_, order, state_lanes_); }

  // State and slope, per s of time, at a time from the start.
  void evaluate(double time, double* state, double* slope) const;

  // The coefficients of all orders, for a saved series.
  std::size_t room() const { return 4 * coefficients_.size(); }
  const double* saved() const { return coefficient(0); }
  void restore(int order, double unit, const double* coefficients);

 private:
  using Rows = std::vector<Lanes<double>>;  // of all orders

  static double* numbers(Rows& rows, int order, std::size_t width) {
    return reinterpret_cast<double*>(rows.data() + static_cast<std::size_t>(order) * width);
  }
  static const double* numbers(const Rows& rows, int order, std::size_t width) {
    return reinterpret_cast<const double*>(rows.data() + static_cast<std::size_t>(order) * width);
  }
  void set_sums();

  const Plan<double>& plan_;
  std::size_t size_, state_lanes_, product_lanes_;
  int order_ = 0;
  double unit_ = 1;
  std::vector<double> slope_, reciprocals_;
  Rows coefficients_, left_, right_, sums_;
  std::vector<double> per_order_;  // 1 / k, for k up to the highest order
};

}  // namespace redysim
