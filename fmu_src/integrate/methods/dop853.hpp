#pragma once

#include "integrate/methods/error_weights.hpp"
#include "integrate/methods/sundials_objects.hpp"

namespace redysim {

class ByteWriter;

// Explicit Runge-Kutta steps of order 8 with error estimates of order 5 and 3, and a polynomial of order 7
// through the step: DOP853 (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 1993, II.5
// and II.6). The interpolants of SUNDIALS' explicit methods are at most of order 5.
class Dop853 {
 public:
  static constexpr int last = 12;    // slope at the end of a step
  static constexpr int stages = 16;  // with those of the polynomial

  // f(time, y) into `slope`; false: impossible.
  using Slope = bool (*)(double time, const double* y, double* slope, void* self);
  Dop853(long size, SUNContext context, Slope of_state, void* self);

  double* first_slope() { return slope(0); }  // f at the start of the next step, to be set before it
  const double* last_slope() const { return sundials::data(vectors_[last]); }  // f at the end, after `fit`

  // A step of h from (time, y) to `end`. False: a stage has no slope.
  bool step(double time, double h, N_Vector y, N_Vector end);
  double error(double h, const ErrorWeights& error_weights, const double* weights);  // of this step, weighted
  // The polynomial through this step. False: a slope is impossible.
  bool fit(double time, double h, N_Vector y, N_Vector end);
  void evaluate(double share, N_Vector y);  // the polynomial at this share of its step

  // Polynomial and last slope.
  static constexpr std::size_t saved = 9;  // times the size of the state
  void put(ByteWriter& writer) const;
  void restore(const double* values);

 private:
  static constexpr int terms = 8;  // of the polynomial
  static constexpr int vectors = stages + terms;
  static constexpr int next_saved(int k) { return k == last ? stages : k + 1; }
  double* slope(int stage) { return sundials::data(vectors_[stage]); }
  double* term(int k) { return sundials::data(vectors_[stages + k]); }
  const double* term(int k) const { return sundials::data(vectors_[stages + k]); }
  N_Vector scratch() { return vectors_[vectors - 1].get(); }  // the last term, until it is computed
  void combine(int stage, double h, N_Vector y, N_Vector result);
  bool set_slope(int stage, double time, double h, N_Vector y);

  std::size_t size_;
  Slope slope_;
  void* self_;
  sundials::Vector vectors_[vectors];  // slopes of the stages, then terms of the polynomial
  N_Vector all_[vectors];              // the same, for SUNDIALS
};

}  // namespace redysim
