#include "integrate/methods/transition.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "integrate/methods/methods.hpp"
#include "integrate/system/dense_lu.hpp"

namespace redysim {
namespace {

constexpr double root6 = 2.449489742783178;
constexpr double times[] = {(4 - root6) / 10, (4 + root6) / 10, 1};
constexpr double table[3][3] = {{(88 - 7 * root6) / 360, (296 - 169 * root6) / 1800, (-2 + 3 * root6) / 225},
                                {(296 + 169 * root6) / 1800, (88 + 7 * root6) / 360, (-2 - 3 * root6) / 225},
                                {(16 - root6) / 36, (16 + root6) / 36, 1.0 / 9}};
// The polynomial through the slopes of the stages, at the start of the step.
constexpr double at_start(int stage) {
  double value = 1;
  for (int k = 0; k < 3; ++k)
    if (k != stage) value *= times[k] / (times[k] - times[stage]);
  return value;
}
// Entry of the square of the table.
constexpr double squared(int i, int j) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) sum += table[i][k] * table[k][j];
  return sum;
}
// Weight of the slope at the start in the embedded formula of order 3.
constexpr double embedded = 0.27;

constexpr int most_iterations = 12;
constexpr long most_steps = 100000;

}  // namespace

Transition::Transition(System& system, int columns, int knowns, Knowns by_knowns)
    : system_(system),
      jacobian_(system, knowns > 0),
      by_knowns_(std::move(by_knowns)),
      size_(static_cast<std::size_t>(system.size())),
      positions_(static_cast<std::size_t>(system.layout().q.count)),
      velocity_(static_cast<std::size_t>(system.layout().qd.begin)),
      rest_(size_ - positions_),
      columns_(static_cast<std::size_t>(columns)),
      knowns_(static_cast<std::size_t>(knowns)),
      weights_(size_),
      slope_(size_),
      jacobians_((stages + 1) * size_ * size_),
      gains_((stages + 1) * size_ * knowns_),
      move_(stages * size_),
      slopes_(move_),
      matrix_(stages * rest_ * stages * rest_),
      reduced_(stages * rest_),
      unknowns_(stages * size_ * columns_),
      matrix_columns_(stages * rest_),
      pivots_(matrix_columns_.size()),
      y_next_(size_),
      next_(size_ * columns_) {
  for (std::size_t j = 0; j < matrix_columns_.size(); ++j) matrix_columns_[j] = &matrix_[j * stages * rest_];
}

Outcome Transition::advance(double time, double end, double rtol, double* y, double* columns) {
  span_ = end - time;
  rtol_ = rtol;
  set_weights();
  double h = span_;
  bool is_linearised = false;  // at (time, y)
  for (long taken = 0; taken < most_steps; ++taken) {
    if (!is_linearised && linearise(0, time, y) != Status::ok)
      return failure(time, "the derivatives are not finite");
    is_linearised = true;
    y0_ = y;
    y_ = columns;
    if (h < smallest_step(time, end))
      return failure(time, "the derivatives of the motion require too small steps");
    double ratio = 0.25;
    if (step(time, h)) {
      const double found = error(h);
      ratio = std::clamp(0.8 / std::sqrt(std::sqrt(found)), 0.1, 5.0);
      if (found <= 1) {
        time = h == end - time ? end : time + h;
        std::copy(y_next_.begin(), y_next_.end(), y);
        std::copy(next_.begin(), next_.end(), columns);
        if (!system_.close_loops(time, y)) return failure(time, reasons::loops_open);
        if (time == end) return {};
        is_linearised = false;
        ratio = std::max(ratio, 0.2);
      }
    }
    const double rest = end - time;
    h *= ratio;
    if (h > 0.5 * rest) h = h >= 0.99 * rest ? rest : 0.5 * rest;
  }
  return failure(time, "the derivatives of the motion require too many steps");
}

// J and G at the start (place 0) or a stage.
Status Transition::linearise(int place, double time, const double* y) {
  double* slope = place == 0 ? slope_.data() : stage(slopes_, place - 1);
  Status status = system_.slope_within_step(time, y, slope);
  if (status == Status::ok)
    status = jacobian_.evaluate(time, y, &jacobians_[static_cast<std::size_t>(place) * size_ * size_]);
  if (status == Status::ok && knowns_ > 0)
    status = by_knowns_(time, y, jacobian_, &gains_[static_cast<std::size_t>(place) * size_ * knowns_]);
  return status;
}

bool Transition::step(double time, double h) {
  if (!solve_stages(time, h)) return false;
  for (int i = 0; i < stages; ++i) {
    for (std::size_t r = 0; r < size_; ++r) y_next_[r] = y0_[r] + stage(move_, i)[r];
    if (linearise(i + 1, time + times[i] * h, y_next_.data()) != Status::ok) return false;
  }
  differentiate(h);
  for (double value : next_)
    if (!std::isfinite(value)) return false;
  return true;
}

// Residuals of the stages, into unknowns_. False: a slope is not finite.
bool Transition::set_residuals(double time, double h) {
  for (int i = 0; i < stages; ++i) {
    for (std::size_t r = 0; r < size_; ++r) y_next_[r] = y0_[r] + stage(move_, i)[r];
    if (system_.slope_within_step(time + times[i] * h, y_next_.data(), stage(slopes_, i)) != Status::ok)
      return false;
  }
  for (int i = 0; i < stages; ++i)
    for (std::size_t r = 0; r < size_; ++r) {
      double& residual = unknowns_[static_cast<std::size_t>(i) * size_ + r];
      residual = -stage(move_, i)[r];
      for (int j = 0; j < stages; ++j) residual += h * table[i][j] * stage(slopes_, j)[r];
    }
  return true;
}

// Simplified Newton iteration for the stages. False: it does not converge.
bool Transition::solve_stages(double time, double h) {
  const double* const start = jacobians_.data();
  if (!factor(h, {start, start, start})) return false;
  for (int i = 0; i < stages; ++i)
    for (std::size_t r = 0; r < size_; ++r) stage(move_, i)[r] = times[i] * h * slope_[r];
  double before = 0;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    if (!set_residuals(time, h)) return false;
    solve(unknowns_.data());
    double change = 0, size = 0;
    for (std::size_t k = 0; k < stages * size_; ++k) {
      move_[k] += unknowns_[k];
      change = std::max(change, std::fabs(unknowns_[k]));
      size = std::max({size, std::fabs(move_[k]), std::fabs(y0_[k % size_])});
    }
    if (!std::isfinite(change)) return false;
    const bool shrinks_well = change < 0.3 * before;
    if (change <= 1e-14 * size || (shrinks_well && change <= 1e-2 * rtol_ * size)) return true;
    if (iteration > 2 && change > 0.9 * before) return change <= 1e-12 * size;  // rounding
    before = change;
  }
  return false;
}

// LU of I - h (table x J) with a Jacobian for each stage, without the positions of joints with one degree of
// freedom: their rates are velocities.
bool Transition::factor(double h, const double* const (&jacobians)[stages]) {
  h_ = h;
  std::copy_n(jacobians, stages, solved_);
  for (std::size_t j = 0; j < stages; ++j)
    for (std::size_t c = 0; c < rest_; ++c) {
      double* const column = matrix_columns_[j * rest_ + c];
      const bool moves = c + positions_ >= velocity_ && c + positions_ < velocity_ + positions_;
      for (std::size_t i = 0; i < stages; ++i) {
        const double* const by_rest = jacobians[i] + (positions_ + c) * size_ + positions_;
        double* const block = column + i * rest_;
        for (std::size_t r = 0; r < rest_; ++r) block[r] = -h * table[i][j] * by_rest[r];
        if (moves)
          subtract(static_cast<std::int64_t>(rest_),
                   h * h * squared(static_cast<int>(i), static_cast<int>(j)),
                   jacobians[i] + (positions_ + c - velocity_) * size_ + positions_, block);
      }
      column[j * rest_ + c] += 1;
    }
  return factor_lu(matrix_columns_.data(), static_cast<std::int64_t>(stages * rest_), pivots_.data());
}

void Transition::solve(double* x) {
  const auto count = static_cast<std::int64_t>(rest_);
  for (std::size_t i = 0; i < stages; ++i) {
    double* const block = &reduced_[i * rest_];
    std::copy_n(x + i * size_ + positions_, rest_, block);
    for (std::size_t k = 0; k < positions_; ++k) {
      double position = 0;
      for (std::size_t j = 0; j < stages; ++j) position += table[i][j] * x[j * size_ + k];
      subtract(count, -h_ * position, solved_[i] + k * size_ + positions_, block);
    }
  }
  solve_lu(matrix_columns_.data(), stages * count, pivots_.data(), reduced_.data());
  for (std::size_t i = 0; i < stages; ++i) {
    std::copy_n(&reduced_[i * rest_], rest_, x + i * size_ + positions_);
    for (std::size_t k = 0; k < positions_; ++k)
      for (std::size_t j = 0; j < stages; ++j)
        x[i * size_ + k] += h_ * table[i][j] * reduced_[j * rest_ + velocity_ - positions_ + k];
  }
}

// Slope of a column y of Y at the start (place 0) or a stage: J y + G.
void Transition::set_slope(std::size_t column, int place, const double* y, double* slope) const {
  const double* const jacobian = &jacobians_[static_cast<std::size_t>(place) * size_ * size_];
  const std::size_t first_known = columns_ - knowns_;
  if (column < first_known)
    std::fill_n(slope, size_, 0.0);
  else
    std::copy_n(&gains_[(static_cast<std::size_t>(place) * knowns_ + column - first_known) * size_], size_,
                slope);
  std::copy_n(y + velocity_, positions_, slope);
  for (std::size_t j = 0; j < size_; ++j)
    if (y[j] != 0)
      subtract(static_cast<std::int64_t>(rest_), -y[j], jacobian + j * size_ + positions_,
               slope + positions_);
}

// Slopes K of Y at the stages, K_i = J_i (Y + h sum_j table_ij K_j) + G_i, into unknowns_; Y at the end into
// next_.
void Transition::differentiate(double h) {
  const std::size_t square = size_ * size_;
  const double* const all = jacobians_.data();
  if (!factor(h, {all + square, all + 2 * square, all + 3 * square})) {
    next_.assign(next_.size(), NAN);
    return;
  }
  for (std::size_t c = 0; c < columns_; ++c) {
    double* const slopes = &unknowns_[c * stages * size_];
    const double* const y = y_ + c * size_;
    for (int i = 0; i < stages; ++i) set_slope(c, i + 1, y, slopes + static_cast<std::size_t>(i) * size_);
    solve(slopes);
    for (std::size_t r = 0; r < size_; ++r) {
      double sum = 0;
      for (int i = 0; i < stages; ++i) sum += table[2][i] * slopes[static_cast<std::size_t>(i) * size_ + r];
      next_[c * size_ + r] = y[r] + h * sum;
    }
  }
}

// The difference d between the embedded formula, of order 3, and that of order 5, for y and all columns of Y,
// relative to their size and to the bound of d. The local error of the latter is about d^(3/2) / 8: the bound
// is rtol^(2/3).
double Transition::error(double h) const {
  constexpr double left[] = {at_start(0), at_start(1), at_start(2)};
  std::vector<double> defect(size_);
  const double bound = std::cbrt(rtol_ * rtol_);
  double worst = 1e-8;
  const auto compare = [&](const double* slopes, const double* before, const double* after) {
    for (std::size_t r = 0; r < size_; ++r)
      for (int i = 0; i < stages; ++i) defect[r] -= left[i] * slopes[static_cast<std::size_t>(i) * size_ + r];
    const double size = std::max(norm(before), norm(after));
    if (size > 0) worst = std::max(worst, embedded * h * norm(defect.data()) / (bound * size));
  };
  defect = slope_;
  compare(slopes_.data(), y0_, y_next_.data());
  for (std::size_t c = 0; c < columns_; ++c) {
    const double* const y = y_ + c * size_;
    set_slope(c, 0, y, defect.data());
    compare(&unknowns_[c * stages * size_], y, &next_[c * size_]);
  }
  return worst;
}

// Positions per duration of the advance; lengths by the scale of their joint. Currents and lagged inputs have
// none: their errors show in the velocities.
void Transition::set_weights() {
  const StateLayout& layout = system_.layout();
  std::fill(weights_.begin(), weights_.end(), 0.0);
  for (int r = 0; r < layout.nq(); ++r) weights_[r] = 1 / span_;
  for (int r = layout.qd.begin; r < layout.omega.end(); ++r) weights_[r] = 1;
  for (int k = 0; k < layout.q.count; ++k) {
    weights_[layout.q[k]] /= system_.scales()[k];
    weights_[layout.qd[k]] /= system_.scales()[k];
  }
  for (int k = 0; k < layout.motor_q.count; ++k) weights_[layout.motor_q[k]] = 1 / span_;
  for (int k = 0; k < layout.motor_qd.count; ++k) weights_[layout.motor_qd[k]] = 1;
}

double Transition::norm(const double* column) const {
  double largest = 0;
  for (std::size_t r = 0; r < size_; ++r) largest = std::max(largest, weights_[r] * std::fabs(column[r]));
  return largest;
}

}  // namespace redysim
