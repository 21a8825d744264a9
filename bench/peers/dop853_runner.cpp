// Compiled equations of one scene with DOP853, for work_precision.py (see serve.hpp and generated.py).
//   dop853_SCENE ROWS STEP
// Methods: `dense` steps past output times and interpolates, `stop` ends a step at each. Value: rtol; atol is
// a hundredth of it.

#include <algorithm>
#include <cmath>

#include "serve.hpp"
#include "slope.cpp"

namespace {

void slope_of(const double* y, double* ydot) {
  const double* in[] = {y};
  double* out[] = {ydot};
  slope(in, out, nullptr, nullptr, 0);
}

#include "stages.hpp"

using redysim::bench::Run;

struct Stepper {
  double y[size], z[size], work[size], k[16][size], f[7][size], rtol;

  double scale(double a, double b) const { return rtol * (0.01 + std::max(std::abs(a), std::abs(b))); }

  // Weighted error of the step to z (Hairer, Norsett, Wanner 1993, II.10)
  double error(double h) const {
    double fifth[size], third[size], square5 = 0, square3 = 0;
    errors(k, fifth, third);
    for (int i = 0; i < size; ++i) {
      const double weight = 1 / scale(y[i], z[i]);
      square5 += fifth[i] * fifth[i] * weight * weight;
      square3 += third[i] * third[i] * weight * weight;
    }
    const double sum = square5 + 0.01 * square3;
    return sum > 0 ? h * square5 / std::sqrt(size * sum) : 0;
  }

  // First step size (II.4)
  double first(double end) {
    double d0 = 0, d1 = 0, d2 = 0;
    for (int i = 0; i < size; ++i) {
      d0 += std::pow(y[i] / scale(y[i], 0), 2);
      d1 += std::pow(k[0][i] / scale(y[i], 0), 2);
    }
    const double small = d0 < 1e-10 || d1 < 1e-10 ? 1e-6 : 0.01 * std::sqrt(d0 / d1);
    for (int i = 0; i < size; ++i) z[i] = y[i] + small * k[0][i];
    slope_of(z, k[1]);
    for (int i = 0; i < size; ++i) d2 += std::pow((k[1][i] - k[0][i]) / scale(y[i], 0), 2);
    const double most = std::sqrt(std::max(d1, d2 / (small * small)) / size);
    return std::min({100 * small, most > 1e-15 ? std::pow(0.01 / most, 1.0 / 8) : 1e-3, end});
  }

  void interpolate(double theta, double* q) const {
    for (int i = 0; i < size / 2; ++i) {
      double value = 0;
      for (int j = 6; j >= 0; --j) value = (value + f[j][i]) * (j % 2 ? 1 - theta : theta);
      q[i] = y[i] + value;
    }
  }
};

class Integration {
 public:
  Integration(double rtol, double end) : end_(end) {
    s_.rtol = rtol;
    std::copy_n(start, size, s_.y);
    slope_of(s_.y, s_.k[0]);
    h_ = s_.first(end);
  }

  // Tries a step, not beyond the limit. Returns its size, 0 if it was rejected; NaN if it is not finite.
  double attempt(double limit) {
    last_ = t_ + h_ >= limit * (1 - 1e-14);
    const double used = last_ ? limit - t_ : h_;
    stages(s_.y, used, s_.k, s_.z);
    const double error = s_.error(used);
    if (!(error < 1e30)) return NAN;
    const double factor = std::clamp(0.9 * std::pow(error, -1.0 / 8), 0.333, rejected_ ? 1.0 : 6.0);
    rejected_ = error >= 1;
    // a step cut at an output time says little about the next one
    if (rejected_ || !last_ || factor * used > h_) h_ = factor * used;
    return rejected_ ? 0 : used;
  }

  void accept(double used, double limit) {
    t_ = last_ ? limit : t_ + used;
    std::copy_n(s_.z, size, s_.y);
    std::copy_n(s_.k[12], size, s_.k[0]);
  }

  // Rows within the attempted step
  int interpolate(double used, int row, int rows, double step, double* to) {
    const double reached = last_ ? end_ : t_ + used;
    if (row > rows || row * step > reached) return row;
    interpolant(s_.y, s_.z, used, s_.k, s_.f, s_.work);
    for (; row <= rows && row * step <= reached; ++row)
      s_.interpolate((row * step - t_) / used, to + row * (size / 2));
    return row;
  }

  const double* state() const { return s_.y; }
  bool at_limit() const { return last_; }

 private:
  Stepper s_;
  double end_, t_ = 0, h_ = 0;
  bool rejected_ = false, last_ = false;
};

Run integrate(bool dense, double rtol, int rows, double step) {
  constexpr int n = size / 2, most_steps = 10000000;
  Run run;
  run.rows.resize((rows + 1) * n);
  std::copy_n(start, n, run.rows.begin());
  const double begin = redysim::bench::cpu_seconds(), end = rows * step;
  Integration integration(rtol, end);
  int row = 1;
  for (int steps = 0; row <= rows; ++steps) {
    const double limit = dense ? end : row * step;
    const double used = integration.attempt(limit);
    if (std::isnan(used) || steps == most_steps) {
      run.failure = steps == most_steps ? "too many steps" : "not finite";
      return run;
    }
    if (used == 0) continue;
    if (dense) row = integration.interpolate(used, row, rows, step, run.rows.data());
    integration.accept(used, limit);
    if (!dense && integration.at_limit()) std::copy_n(integration.state(), n, &run.rows[row++ * n]);
  }
  run.seconds = redysim::bench::cpu_seconds() - begin;
  return run;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) {
    std::cerr << "usage: dop853_SCENE ROWS STEP\n";
    return 2;
  }
  const int rows = std::stoi(arguments[1]);
  const double step = std::stod(arguments[2]);
  redysim::bench::serve(size / 2, [=](const std::string& method, double rtol) {
    return integrate(method == "dense", rtol, rows, step);
  });
}
