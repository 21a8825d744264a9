#pragma once

#include <vector>

#include "integrate/methods/error_weights.hpp"
#include "math/lanes.hpp"

namespace redysim {

struct ExplicitTable {
  int error_order;   // local error estimate ~ h^error_order
  int last;          // index of the result; equals the right-hand sides per step while inputs are held
  double stability;  // length of the stability interval on the negative real axis
  const double* times;
  int combinations;  // number of combinations before its first one
};
extern const ExplicitTable bogacki_shampine, dormand_prince, dop853;

// Explicit Runge-Kutta steps with the tables of explicit_tables.hpp; the sums of stages stay in registers.
// SUNDIALS' ARKODE takes the same steps of order 3 and 5, but with twice the overhead besides the right-hand
// sides, and interpolates by polynomials of order 5 at most.
class ExplicitSteps {
 public:
  // Computes f(time, y) into `slope`; false: not possible.
  using Slope = bool (*)(double time, const double* y, double* slope, void* self);
  ExplicitSteps(std::size_t size, Slope of_state, void* self);

  void use(const ExplicitTable& table) { table_ = &table; }
  // Whether a step evaluates the slope at its end, for the error estimate; otherwise `fit` does.
  bool ends_with_slope() const { return table_ != &dop853; }

  double* first_slope() { return numbers(0); }  // f at the start of the next step, to be set before it
  const double* last_slope() const { return numbers(table_->last); }  // f at the end of the step

  // Takes a step of size h from (time, y) to `end`. False: a slope cannot be computed.
  bool step(double time, double h, const double* y, double* end);
  double error(double h, const ErrorWeights& error_weights, const double* weights);  // weighted, of this step

  // The polynomial of order 7 through a step of DOP853: `fit` computes it, `evaluate` gives y at a share of
  // the step.
  bool fit(double time, double h);  // false: a slope cannot be computed
  void evaluate(double share, double* y);
  // Coefficient of its last term, whose factor is at most 0.0084.
  const double* last_term() const { return numbers(stage - 1); }
  // The polynomial and the last slope as saved values.
  std::size_t saved() const { return 9 * size_; }
  void save(double* values) const;
  void restore(const double* values);

 private:
  // Rows have the length of the state: slopes, terms of the polynomial, the present stage, zeros.
  static constexpr int fitted = 12;     // slope at the end of a step of DOP853
  static constexpr int stages = 16;     // including the stages of the polynomial
  static constexpr int start = stages;  // state at the start, also the first term
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

  std::size_t size_, width_;  // width of a row: in numbers, in lanes
  Slope slope_;
  void* self_;
  std::vector<Lanes<double>> rows_;
  const ExplicitTable* table_ = &dop853;
};

}  // namespace redysim
