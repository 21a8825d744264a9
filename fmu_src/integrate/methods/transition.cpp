#include "integrate/methods/transition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "integrate/methods/methods.hpp"
#include "integrate/system/dense_lu.hpp"
#include "model/any_of.hpp"

namespace redysim {
namespace {

constexpr double root6 = 2.449489742783178;

// Weight of the slope at the start in the embedded formula of order 3.
constexpr double embedded = 0.27;

constexpr int most_iterations = 12;
constexpr long most_steps = 100000;
constexpr double safety = 0.7;  // since the angle is an estimate

// Step size of at most about h: half the rest where two steps reach the end.
double fitted(double h, double rest) { return h <= 0.5 * rest ? h : h >= 0.99 * rest ? rest : 0.5 * rest; }

}  // namespace

Transition::Method::Method(std::initializer_list<double> nodes) : stages(nodes.size()), extrapolation(1) {
  std::copy(nodes.begin(), nodes.end(), times);
  for (std::size_t j = 0; j < stages; ++j) {
    double polynomial[most_stages + 1] = {1};  // coefficients of the Lagrange polynomial in powers of time
    std::size_t order = 0;
    for (std::size_t k = 0; k < stages; ++k) {
      if (k == j) continue;
      const double scale = 1 / (times[j] - times[k]);
      ++order;
      for (std::size_t n = order; n > 0; --n)
        polynomial[n] = scale * (polynomial[n - 1] - times[k] * polynomial[n]);
      polynomial[0] *= -scale * times[k];
    }
    const auto integral = [&](double to) {
      double sum = 0;
      for (std::size_t n = stages; n > 0; --n) sum = to * (polynomial[n - 1] / static_cast<double>(n) + sum);
      return sum;
    };
    for (std::size_t i = 0; i < stages; ++i) table[i][j] = integral(times[i]);
    weights[j] = integral(1);
    start[j] = polynomial[0];
    highest[j] = std::tgamma(static_cast<double>(stages)) * polynomial[stages - 1];
  }
  // s! / (2 s)! and (s!)^2 / ((2 s)! (2 s + 1)!)
  for (std::size_t k = 1; k <= stages; ++k) extrapolation /= static_cast<double>(stages + k);
  error = extrapolation;
  for (std::size_t k = stages + 1; k <= 2 * stages + 1; ++k) error /= static_cast<double>(k);
}

double Transition::Method::squared(std::size_t i, std::size_t j) const {
  double sum = 0;
  for (std::size_t k = 0; k < stages; ++k) sum += table[i][k] * table[k][j];
  return sum;
}

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
      methods_{Method{0.5 - 0.28867513459481287, 0.5 + 0.28867513459481287},
               Method{0.5 - 0.3872983346207417, 0.5, 0.5 + 0.3872983346207417},
               Method{0.5 - 0.4305681557970263, 0.5 - 0.1699905217924281, 0.5 + 0.1699905217924281,
                      0.5 + 0.4305681557970263},
               Method{(4 - root6) / 10, (4 + root6) / 10, 1}},
      method_(&methods_.front()),
      weights_(size_),
      rate_weights_(size_),
      slope_(size_),
      end_slope_(size_),
      jacobians_((most_stages + 1) * size_ * size_),
      gains_((most_stages + 1) * size_ * knowns_),
      move_(most_stages * size_),
      slopes_(move_),
      matrix_(most_stages * rest_ * most_stages * rest_),
      matrix_columns_(most_stages * rest_),
      pivots_(matrix_columns_.size()),
      reduced_(most_stages * rest_ * columns_),
      position_(columns_),
      y_next_(size_),
      columns_before_(size_ * columns_),
      before_(columns_before_),
      changes_(most_stages * size_ * columns_),
      next_(columns_before_) {
  for (std::size_t j = 0; j < matrix_columns_.size(); ++j)
    matrix_columns_[j] = &matrix_[j * most_stages * rest_];
}

Outcome Transition::advance(double time, double end, double rtol, double* y, double* columns,
                            const double* y_end) {
  span_ = end - time;
  rtol_ = rtol;
  rounding_.assign(knowns_, 0.0);
  set_weights();
  y0_ = y;
  for (std::size_t c = 0; c < columns_; ++c)
    for (std::size_t r = 0; r < size_; ++r) columns_before_[r * columns_ + c] = columns[c * size_ + r];
  Outcome outcome;
  if (y_end != nullptr && advance_smoothly(time, y_end)) {
    std::copy_n(y_end, size_, y);
    columns_before_.swap(next_);
  } else {
    method_ = &methods_.back();
    if (system_.has_constraints() && knowns_ > 0) set_rounding(time, y);
    outcome = advance_by_steps(time, end, y);
  }
  for (std::size_t c = 0; c < columns_; ++c)
    for (std::size_t r = 0; r < size_; ++r) columns[c * size_ + r] = columns_before_[r * columns_ + c];
  return outcome;
}

// Tries the whole advance as one step of Gauss's method. False: the motion or its derivatives are not smooth
// enough.
bool Transition::advance_smoothly(double time, const double* y_end) {
  if (system_.slope_within_step(time, y0_, slope_.data()) != Status::ok ||
      system_.slope_within_step(time + span_, y_end, end_slope_.data()) != Status::ok)
    return false;
  method_ = &methods_.front();
  for (;;) {
    const double angle = smooth_step(time, y_end);
    if (is_accurate(angle)) return true;
    do
      if (++method_ == &methods_.back()) return false;
    while (!is_accurate(angle));
  }
}

// Whether the step meets the tolerance for a vibration whose phase advances by this angle, rad.
bool Transition::is_accurate(double angle) const {
  return method_->error * std::pow(angle, 2 * static_cast<double>(method_->stages) + 1) <= safety * rtol_;
}

// Sets y_next_ and next_ to y and Y at the end. Returns the phase angle, rad, of a vibration with equal
// slopes, or NaN.
double Transition::smooth_step(double time, const double* y_end) {
  double angle = iterate_stages(time, y_end);
  if (!is_accurate(angle)) return angle;
  if (!linearise_stages(time, span_)) return NAN;
  std::copy_n(y0_, size_, y_next_.begin());
  for (std::size_t i = 0; i < method_->stages; ++i)
    for (std::size_t r = 0; r < size_; ++r) y_next_[r] += span_ * method_->weights[i] * stage(slopes_, i)[r];
  if (!agrees(y_end) || !differentiate(span_)) return NAN;
  // a known changes the rates first, then the positions in proportion to time
  const double largest = relative_size({changes_.data(), columns_before_.data(), next_.data(), columns_,
                                        columns_ - knowns_, rate_weights_.data()},
                                       method_->highest, nullptr);
  return std::max(std::pow(span_ * largest, 1 / static_cast<double>(method_->stages)), angle);
}

// Functional iteration for the stages, from the cubic through both ends. Returns the phase angle, rad, or
// NaN.
double Transition::iterate_stages(double time, const double* y_end) {
  for (std::size_t i = 0; i < method_->stages; ++i)
    for (std::size_t r = 0; r < size_; ++r) {
      const double c = method_->times[i], first = span_ * slope_[r], last = span_ * end_slope_[r];
      const double move = y_end[r] - y0_[r];
      stage(move_, i)[r] = c * (first + c * (3 * move - 2 * first - last + c * (first + last - 2 * move)));
    }
  double before = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    if (!set_residuals(time, span_)) return NAN;
    const double angle = angle_of_motion();
    if (!is_accurate(angle)) return angle;
    double change = 0, size = 0;
    for (std::size_t k = 0; k < method_->stages * size_; ++k) {
      move_[k] += changes_[k];
      change = std::max(change, std::fabs(changes_[k]));
      size = std::max({size, std::fabs(move_[k]), std::fabs(y0_[k % size_])});
    }
    if (change <= 0.1 * rtol_ * size) return angle;
    if (!(change <= 0.2 * before)) return NAN;
    before = change;
  }
  return NAN;
}

// Phase angle, rad, from the deviation of the accelerations at both ends from the polynomial through those at
// the stages, each relative to its largest value.
double Transition::angle_of_motion() {
  const std::size_t stages = method_->stages;
  const auto largest = [&](std::size_t r) {
    double value = std::max(std::fabs(slope_[r]), std::fabs(end_slope_[r]));
    for (std::size_t i = 0; i < stages; ++i) value = std::max(value, std::fabs(stage(slopes_, i)[r]));
    return rate_weights_[r] * value;
  };
  constexpr double negligible = 1e-3;  // relative to the largest acceleration
  double least = 0, worst = 0;
  for (std::size_t r = 0; r < size_; ++r) least = std::max(least, negligible * largest(r));
  if (least == 0) return 0;
  for (std::size_t r = 0; r < size_; ++r) {
    double at_start = slope_[r], at_end = end_slope_[r];
    for (std::size_t i = 0; i < stages; ++i) {
      at_start -= method_->start[i] * stage(slopes_, i)[r];
      at_end -= method_->start[stages - 1 - i] * stage(slopes_, i)[r];
    }
    worst = std::max(worst, rate_weights_[r] * std::max(std::fabs(at_start), std::fabs(at_end)) /
                                std::max(least, largest(r)));
  }
  return std::pow(worst / method_->extrapolation, 1 / static_cast<double>(stages));
}

// Whether the step ends at the known end state: it then missed no contact of the motion.
bool Transition::agrees(const double* y_end) const {
  const StateLayout& layout = system_.layout();
  double difference = 0, size = 1;
  for (int r = layout.qd.begin; r < layout.omega.end(); ++r) {
    difference = std::max(difference, weights_[r] * std::fabs(y_next_[r] - y_end[r]));
    size = std::max(size, weights_[r] * std::fabs(y_end[r]));
  }
  return difference <= 10 * rtol_ * size;
}

// Integrates by steps of Radau IIA; leaves Y at the end in columns_before_.
Outcome Transition::advance_by_steps(double time, double end, double* y) {
  double h = span_;
  bool is_linearised = false;  // J and G at (time, y) are known
  for (long taken = 0; taken < most_steps; ++taken) {
    if (!is_linearised && linearise(0, time, y) != Status::ok)
      return failure(time, "the derivatives are not finite");
    is_linearised = true;
    if (h < std::min(smallest_step(time, end), span_))
      return failure(time, "the derivatives of the motion require too small steps");
    const double found = step(time, h) ? error(h) : NAN;
    double ratio = std::isfinite(found) ? std::clamp(0.8 / std::sqrt(std::sqrt(found)), 0.1, 5.0) : 0.25;
    if (found <= 1) {
      time = h == end - time ? end : time + h;
      std::copy(y_next_.begin(), y_next_.end(), y);
      columns_before_.swap(next_);
      if (!system_.close_loops(time, y)) return failure(time, reasons::loops_open);
      if (time == end) return {};
      is_linearised = false;
      ratio = std::max(ratio, 0.2);
    }
    h = fitted(ratio * h, end - time);
  }
  return failure(time, "the derivatives of the motion require too many steps");
}

// Evaluates J and G at the start (place 0) or at a stage.
Status Transition::linearise(std::size_t place, double time, const double* y) {
  double* slope = place == 0 ? slope_.data() : stage(slopes_, place - 1);
  Status status = jacobian_.evaluate(time, y, &jacobians_[place * size_ * size_], slope);
  if (status == Status::ok && knowns_ > 0)
    status = by_knowns_(time, y, jacobian_, &gains_[place * size_ * knowns_]);
  return status;
}

// Sets rounding_. A known without effect, due to constraints, has a G of rounding errors only: they are
// estimated by comparison with G at a point that is equal up to rounding.
void Transition::set_rounding(double time, const double* y) {
  constexpr double nudge = 1e-15, sample = 100;  // factor, since one difference may be small by chance
  for (std::size_t r = 0; r < size_; ++r) {
    const double size = static_cast<int>(r) < system_.layout().nq() ? 1 / (span_ * weights_[r]) : 0;
    y_next_[r] = y[r] + nudge * std::max(std::fabs(y[r]), size);
  }
  if (linearise(0, time, y) != Status::ok || linearise(1, time, y_next_.data()) != Status::ok) return;
  for (std::size_t k = 0; k < knowns_; ++k)
    for (std::size_t r = 0; r < size_; ++r) {
      const double change = gains_[k * size_ + r] - gains_[(knowns_ + k) * size_ + r];
      rounding_[k] = std::max(rounding_[k], sample * weights_[r] * std::fabs(change));
    }
}

bool Transition::linearise_stages(double time, double h) {
  for (std::size_t i = 0; i < method_->stages; ++i) {
    for (std::size_t r = 0; r < size_; ++r) y_next_[r] = y0_[r] + stage(move_, i)[r];
    if (linearise(i + 1, time + method_->times[i] * h, y_next_.data()) != Status::ok) return false;
  }
  return true;
}

// Takes one step of Radau IIA, whose last stage is the end of the step.
bool Transition::step(double time, double h) {
  return solve_stages(time, h) && linearise_stages(time, h) && differentiate(h);
}

// Sets changes_ to the residuals of the stages. False: a slope is not finite.
bool Transition::set_residuals(double time, double h) {
  for (std::size_t i = 0; i < method_->stages; ++i) {
    for (std::size_t r = 0; r < size_; ++r) y_next_[r] = y0_[r] + stage(move_, i)[r];
    if (system_.slope_within_step(time + method_->times[i] * h, y_next_.data(), stage(slopes_, i)) !=
        Status::ok)
      return false;
  }
  for (std::size_t i = 0; i < method_->stages; ++i)
    for (std::size_t r = 0; r < size_; ++r) {
      double& residual = changes_[i * size_ + r];
      residual = -stage(move_, i)[r];
      for (std::size_t j = 0; j < method_->stages; ++j)
        residual += h * method_->table[i][j] * stage(slopes_, j)[r];
    }
  return true;
}

// Simplified Newton iteration for the stages. False: it does not converge.
bool Transition::solve_stages(double time, double h) {
  const double* const start = jacobians_.data();
  if (!factor(h, {start, start, start})) return false;
  for (std::size_t i = 0; i < method_->stages; ++i)
    for (std::size_t r = 0; r < size_; ++r) stage(move_, i)[r] = method_->times[i] * h * slope_[r];
  double before = 0;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    if (!set_residuals(time, h)) return false;
    solve(changes_.data(), 1);
    double change = 0, size = 0;
    for (std::size_t k = 0; k < method_->stages * size_; ++k) {
      move_[k] += changes_[k];
      change = std::max(change, std::fabs(changes_[k]));
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

// LU factors of I - h (table x J) with one Jacobian per stage. The positions of joints with one degree of
// freedom are eliminated: their rates are velocities.
bool Transition::factor(double h, const double* const (&jacobians)[most_stages]) {
  const std::size_t stages = method_->stages;
  h_ = h;
  std::copy_n(jacobians, stages, solved_);
  for (std::size_t j = 0; j < stages; ++j)
    for (std::size_t c = 0; c < rest_; ++c) {
      double* const column = matrix_columns_[j * rest_ + c];
      const bool moves = c + positions_ >= velocity_ && c + positions_ < velocity_ + positions_;
      for (std::size_t i = 0; i < stages; ++i) {
        const double* const by_rest = jacobians[i] + (positions_ + c) * size_ + positions_;
        double* const block = column + i * rest_;
        for (std::size_t r = 0; r < rest_; ++r) block[r] = -h * method_->table[i][j] * by_rest[r];
        if (moves)
          subtract(static_cast<std::int64_t>(rest_), h * h * method_->squared(i, j),
                   jacobians[i] + (positions_ + c - velocity_) * size_ + positions_, block);
      }
      column[j * rest_ + c] += 1;
    }
  return factor_lu(matrix_columns_.data(), static_cast<std::int64_t>(stages * rest_), pivots_.data());
}

// Replaces `count` right-hand sides (stages * size_ rows) by the solutions.
void Transition::solve(double* x, std::size_t count) {
  const std::size_t stages = method_->stages;
  const auto n = static_cast<std::int64_t>(count);
  const auto row = [&](std::size_t i, std::size_t r) { return x + (i * size_ + r) * count; };
  const auto add = [n](double factor, const double* from, double* to) { subtract(n, -factor, from, to); };
  for (std::size_t i = 0; i < stages; ++i) {
    double* const block = &reduced_[i * rest_ * count];
    std::copy_n(row(i, positions_), rest_ * count, block);
    for (std::size_t k = 0; k < positions_; ++k) {
      std::fill_n(position_.begin(), count, 0.0);
      for (std::size_t j = 0; j < stages; ++j) add(h_ * method_->table[i][j], row(j, k), position_.data());
      const double* const by_position = solved_[i] + k * size_ + positions_;
      for (std::size_t r = 0; r < rest_; ++r)
        if (by_position[r] != 0) add(by_position[r], position_.data(), block + r * count);
    }
  }
  solve_lu(matrix_columns_.data(), static_cast<std::int64_t>(stages * rest_), pivots_.data(), reduced_.data(),
           n);
  for (std::size_t i = 0; i < stages; ++i) {
    std::copy_n(&reduced_[i * rest_ * count], rest_ * count, row(i, positions_));
    for (std::size_t k = 0; k < positions_; ++k)
      for (std::size_t j = 0; j < stages; ++j)
        add(h_ * method_->table[i][j], &reduced_[(j * rest_ + velocity_ - positions_ + k) * count],
            row(i, k));
  }
}

// Slopes J Y + G of Y = columns_before_, with J and G at the start (place 0) or at a stage.
void Transition::set_slopes(std::size_t place, double* slopes) const {
  const double* const jacobian = &jacobians_[place * size_ * size_];
  const double* const gains = &gains_[place * size_ * knowns_];
  const std::size_t first_known = columns_ - knowns_;
  std::copy_n(&columns_before_[velocity_ * columns_], positions_ * columns_, slopes);
  for (std::size_t r = positions_; r < size_; ++r) {
    double* const row = slopes + r * columns_;
    std::fill_n(row, first_known, 0.0);
    for (std::size_t k = 0; k < knowns_; ++k) row[first_known + k] = gains[k * size_ + r];
    for (std::size_t j = 0; j < size_; ++j)
      if (jacobian[j * size_ + r] != 0)
        subtract(static_cast<std::int64_t>(columns_), -jacobian[j * size_ + r],
                 &columns_before_[j * columns_], row);
  }
}

// Slopes K of Y at the stages, K_i = J_i (Y + h sum_j table_ij K_j) + G_i, into changes_; Y at the end into
// next_. False: a result is not finite.
bool Transition::differentiate(double h) {
  const std::size_t square = size_ * size_, all = size_ * columns_;
  const double* const at = jacobians_.data();
  if (!factor(h, {at + square, at + 2 * square, at + 3 * square, at + 4 * square})) return false;
  for (std::size_t i = 0; i < method_->stages; ++i) set_slopes(i + 1, &changes_[i * all]);
  solve(changes_.data(), columns_);
  next_ = columns_before_;
  for (std::size_t i = 0; i < method_->stages; ++i)
    subtract(static_cast<std::int64_t>(all), -h * method_->weights[i], &changes_[i * all], next_.data());
  return !any_of(next_, [](double value) { return !std::isfinite(value); });
}

// Weighted sum of the slopes at the stages with these factors, plus that at the start (null: none), relative
// to the size of its column; maximum of all columns.
double Transition::relative_size(const Rows& rows, const double* factors, const double* at_start) {
  const std::size_t count = rows.count;
  defects_.assign(count, 0.0);
  sizes_.assign(count, 0.0);
  for (std::size_t r = 0; r < size_; ++r) {
    if (at_start == nullptr)
      std::fill_n(position_.begin(), count, 0.0);
    else
      std::copy_n(at_start + r * count, count, position_.begin());
    for (std::size_t i = 0; i < method_->stages; ++i)
      subtract(static_cast<std::int64_t>(count), -factors[i], rows.slopes + (i * size_ + r) * count,
               position_.data());
    for (std::size_t c = 0; c < count; ++c) {
      const double weight = c < rows.first_known ? weights_[r] : rows.known_weights[r];
      const std::size_t at = r * count + c;
      defects_[c] = std::max(defects_[c], weight * std::fabs(position_[c]));
      sizes_[c] =
          std::max(sizes_[c], weights_[r] * std::max(std::fabs(rows.before[at]), std::fabs(rows.after[at])));
    }
  }
  for (std::size_t k = 0; method_ == &methods_.back() && count == columns_ && k < knowns_; ++k) {
    double& size = sizes_[columns_ - knowns_ + k];
    size = std::max(size, least_size(rows, k));
  }
  double worst = 0;
  for (std::size_t c = 0; c < count; ++c)
    if (sizes_[c] > 0) worst = std::max(worst, defects_[c] / sizes_[c]);
  return worst;
}

// Minimum size of a known's column. It is no more accurate than G. Where it begins to grow, as at a
// touch-down, every step is long compared with it: its size is then its rate times the length of the advance.
double Transition::least_size(const Rows& rows, std::size_t known) const {
  constexpr double begun = 0.1;
  const std::size_t c = columns_ - knowns_ + known;
  double before = 0, rate = 0;
  for (std::size_t r = 0; r < size_; ++r) {
    before = std::max(before, weights_[r] * std::fabs(rows.before[r * columns_ + c]));
    for (std::size_t i = 0; i < method_->stages; ++i)
      rate = std::max(rate, weights_[r] * std::fabs(rows.slopes[(i * size_ + r) * columns_ + c]));
  }
  const double least = span_ * rounding_[known] / rtol_;
  return before < begun * span_ * rate ? std::max(least, span_ * rate) : least;
}

// Difference d between the embedded formula of order 3 and the step of order 5, for y and all columns of Y,
// relative to their size and to the bound of d. The local error of the step is about d^(3/2) / 8, and the
// errors accumulate: the bound is (0.1 rtol)^(2/3).
double Transition::error(double h) {
  double left[most_stages];
  for (std::size_t i = 0; i < method_->stages; ++i) left[i] = -method_->start[i];
  set_slopes(0, before_.data());
  const double of_state =
      relative_size({slopes_.data(), y0_, y_next_.data(), 1, 1, nullptr}, left, slope_.data());
  const double of_columns =
      relative_size({changes_.data(), columns_before_.data(), next_.data(), columns_, columns_, nullptr},
                    left, before_.data());
  return std::max(1e-8, embedded * h * std::max(of_state, of_columns) / std::cbrt(0.01 * rtol_ * rtol_));
}

// Positions are weighted by 1 / length of the advance, lengths by the scale of their joint. Currents and
// lagged inputs have weight 0: their errors appear in the velocities.
void Transition::set_weights() {
  const StateLayout& layout = system_.layout();
  std::fill(weights_.begin(), weights_.end(), 0.0);
  for (int r = 0; r < layout.nq(); ++r) weights_[r] = 1 / span_;
  for (int r = layout.qd.begin; r < layout.omega.end(); ++r) weights_[r] = 1;
  for (int k = 0; k < layout.q.count; ++k) {
    weights_[layout.q[k]] /= system_.scales()[k];
    weights_[layout.qd[k]] /= system_.scales()[k];
  }
  for (int k = 0; k < layout.motor_qd.count; ++k) weights_[layout.motor_qd[k]] = 1;
  rate_weights_ = weights_;
  std::fill_n(rate_weights_.begin(), layout.nq(), 0.0);
  for (int k = 0; k < layout.motor_q.count; ++k) weights_[layout.motor_q[k]] = 1 / span_;
}

}  // namespace redysim
