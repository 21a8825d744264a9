#pragma once

#include <vector>

#include "integrate/methods/error_weights.hpp"
#include "math/lanes.hpp"

namespace redysim {

// Explicit Runge-Kutta steps of order 8 with error estimates of order 5 and 3, and a polynomial of order 7
// through the step: DOP853 (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 1993, II.5
// and II.6). The interpolants of SUNDIALS' explicit methods are at most of order 5.
class Dop853 {
 public:
  // f(time, y) into `slope`; false: impossible.
  using Slope = bool (*)(double time, const double* y, double* slope, void* self);
  Dop853(std::size_t size, Slope of_state, void* self);

  double* first_slope() { return numbers(0); }  // f at the start of the next step, to be set before it
  const double* last_slope() const { return numbers(last); }  // f at the end, after `fit`

  // A step of h from (time, y) to `end`. False: a stage has no slope.
  bool step(double time, double h, const double* y, double* end);
  double error(double h, const ErrorWeights& error_weights, const double* weights);  // of this step, weighted
  bool fit(double time, double h);         // the polynomial through this step; false: a slope is impossible
  void evaluate(double share, double* y);  // the polynomial at this share of its step

  // Polynomial and last slope.
  std::size_t saved() const { return 9 * size_; }
  void save(double* values) const;
  void restore(const double* values);

 private:
  // Rows of numbers, each as long as the state: slopes, terms of the polynomial, the present stage, zeros.
  static constexpr int last = 12;       // slope at the end of a step
  static constexpr int stages = 16;     // with those of the polynomial
  static constexpr int start = stages;  // the state there, the first term
  static constexpr int terms = 8, stage = start + terms, zero = stage + 1;
  static constexpr int next_saved(int k) { return k == last ? start : k + 1; }
  Lanes<double>* row(int k) { return &rows_[static_cast<std::size_t>(k) * width_]; }
  double* numbers(int k) { return reinterpret_cast<double*>(row(k)); }
  const double* numbers(int k) const {
    return reinterpret_cast<const double*>(&rows_[static_cast<std::size_t>(k) * width_]);
  }

  void sum(int count, const double* factors, const unsigned char* which, double h, int base, int result);
  void combine(int combination, double h, int base, int result);
  double norm(int combination, const ErrorWeights& error_weights, const double* weights);
  bool set_slope(int k, double time, double h);

  std::size_t size_, width_;  // of a row: numbers, lanes
  Slope slope_;
  void* self_;
  std::vector<Lanes<double>> rows_;
};

}  // namespace redysim
