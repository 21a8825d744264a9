#pragma once

#include <vector>

#include "integrate/methods/error_weights.hpp"
#include "math/lanes.hpp"

namespace redysim {

struct ExplicitTable {
  int error_order;   // local error estimate ~ h^error_order
  int last;          // stage of the step; with the same inputs, it takes so many right-hand sides
  double stability;  // its interval on the negative real axis
  const double* times;
  int combinations;  // before the first of its own
};
extern const ExplicitTable bogacki_shampine, dormand_prince, dop853;

// Explicit Runge-Kutta steps of the tables of explicit_tables.hpp, whose stages are summed in registers:
// SUNDIALS' ARKODE takes the same steps of order 3 and 5, but spends twice the time beside their right-hand
// sides, and interpolates by polynomials of order 5 at most.
class ExplicitSteps {
 public:
  // f(time, y) into `slope`; false: impossible.
  using Slope = bool (*)(double time, const double* y, double* slope, void* self);
  ExplicitSteps(std::size_t size, Slope of_state, void* self);

  void use(const ExplicitTable& table) { table_ = &table; }
  // Whether a step evaluates the slope at its end, for the error estimate; otherwise `fit` does.
  bool ends_with_slope() const { return table_ != &dop853; }

  double* first_slope() { return numbers(0); }  // f at the start of the next step, to be set before it
  const double* last_slope() const { return numbers(table_->last); }  // f at the end

  // A step of h from (time, y) to `end`. False: a stage has no slope.
  bool step(double time, double h, const double* y, double* end);
  double error(double h, const ErrorWeights& error_weights, const double* weights);  // of this step, weighted

  // The polynomial of order 7 through a step of DOP853. `evaluate`: at a share of the step.
  bool fit(double time, double h);  // false: a slope is impossible
  void evaluate(double share, double* y);
  // Polynomial and last slope.
  std::size_t saved() const { return 9 * size_; }
  void save(double* values) const;
  void restore(const double* values);

 private:
  // Rows of numbers, each as long as the state: slopes, terms of the polynomial, the present stage, zeros.
  static constexpr int fitted = 12;     // slope at the end of a step of DOP853
  static constexpr int stages = 16;     // with those of the polynomial
  static constexpr int start = stages;  // the state there, the first term
  static constexpr int terms = 8, stage = start + terms, zero = stage + 1;
  static constexpr int next_saved(int k) { return k == fitted ? start : k + 1; }
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
  const ExplicitTable* table_ = &dop853;
};

}  // namespace redysim
