#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/straight_line/taylor_series.hpp"
#include "integrate/methods/error_weights.hpp"
#include "integrate/methods/methods.hpp"
#include "integrate/methods/state_bytes.hpp"
#include "integrate/methods/step_budget.hpp"
#include "integrate/methods/step_control.hpp"

// Steps by Taylor series (Jorba, Zou 2005, Experimental Mathematics 14(1)), for a library of one scene.
//
// A series is used up to its extent, across the ends of advances, while the inputs stay the same. The extent
// follows from the last coefficients and from a test: the slope of the series at its extent must agree with
// the equations of motion. A rejected extent is shortened without new coefficients.

namespace redysim {
namespace {

constexpr double tightening = 0.1;  // tightens the tolerance: the estimate is not extrapolated
constexpr int lowest_order = 4, highest_order = 20;
constexpr int last_orders = 2;      // they limit the extent: at rest, every second one of q vanishes
constexpr double negligible = 0.1;  // maximum size of both where the inputs change before the extent
constexpr double growth = 5;        // maximum, from one extent to the next
constexpr double first_unit = 1;    // s
constexpr double smaller_unit = 1e-4, smallest_unit = 1e-20;  // after coefficients that overflow
constexpr double safety = 0.9, reduction = 0.1;               // after a rejected extent

// Even order with nearly minimum work at equal error (measured: 2 to 6 joints, rtol 1e-2 to 1e-13).
int order_for(double rtol) {
  const int half = static_cast<int>(std::lround(2.4 - 0.225 * std::log(rtol)));
  return std::clamp(2 * half, lowest_order, highest_order);
}

class Taylor final : public Integrator {
 public:
  Taylor(System& system, const SolverSettings& settings)
      : system_(system),
        settings_(settings),
        error_weights_(system, tightening * settings.rtol, tightening * settings.atol),
        longest_(step_limit(settings.max_step)),
        order_(order_for(tightening * settings.rtol)),
        y_(static_cast<std::size_t>(system.size())),
        series_(system.plan(), system.size(), order_),
        end_state_(y_),
        weights_(y_),
        error_(y_),
        forces_(static_cast<std::size_t>(system.plan().nv)),
        no_forces_(forces_) {}

  Outcome start(double time, const double* y) override;
  void set_state(const double* y) override {
    std::copy_n(y, y_.size(), y_.begin());
    forget_series();
  }
  Outcome advance(double end, bool inputs_changed) override;
  bool reaches(double end) const override { return has_series_ && end - origin_ - series_since_ <= extent_; }

  double time() const override { return origin_ + since_; }
  const double* state() const override { return y_.data(); }
  const Statistics& statistics() const override { return statistics_; }
  const char* name() const override { return "taylor"; }
  SolverMethod method() const override { return SolverMethod::taylor; }

  void save(std::vector<unsigned char>& bytes) const override;
  bool restore(const unsigned char* bytes, std::size_t size) override;

 private:
  void forget_series();
  const char* make_series(double aim);
  double expand(double aim);
  bool suffices(double aim) const;
  double norm(const double* change) const { return error_weights_.norm(change, weights_.data()); }
  double extent_of_terms() const;
  double error_at_extent();
  const double* force_coefficients(double since, int order);  // order > 0: only with input slopes

  System& system_;
  SolverSettings settings_;
  ErrorWeights error_weights_;
  double longest_;  // maximum step size, s
  int order_;

  double origin_ = 0;  // end of the last advance
  double since_ = 0;   // time since then
  std::vector<double> y_;
  TaylorSeries series_;
  bool has_series_ = false;   // a series for the present inputs contains time()
  double series_since_ = 0;   // start of the series since origin_
  double extent_ = 0;         // length of the series, s
  double unit_ = first_unit;  // time unit of the next series, s
  bool slope_known_ = false;  // series_ holds the slope at its next start
  Statistics statistics_;
  std::vector<double> end_state_, weights_, error_, forces_, no_forces_;  // end_state_: at the extent
};

Outcome Taylor::start(double time, const double* y) {
  origin_ = time;
  since_ = 0;
  unit_ = first_unit;
  has_series_ = slope_known_ = false;
  statistics_ = {};
  std::copy_n(y, y_.size(), y_.begin());
  return check_start(time, y_);
}

void Taylor::forget_series() {
  if (has_series_) ++statistics_.evaluations;  // the evaluation that tested its extent is lost
  has_series_ = slope_known_ = false;
}

Outcome Taylor::advance(double end, bool inputs_changed) {
  if (end == time()) return {};
  if (!is_later(end, time())) return failure(time(), reasons::end_not_later);
  if (inputs_changed) forget_series();
  const double length = end - origin_;
  StepBudget budget(since_, length);
  const long pause = pause_after_ > 0 ? pause_after_ : std::numeric_limits<long>::max();
  for (long taken = 0; taken < pause; ++taken) {
    if (!has_series_)
      if (const char* why = make_series(inputs_changed ? length - since_ : longest_))
        return failure(time(), why);
    if (length - series_since_ <= extent_) {
      series_.evaluate(length - series_since_, y_.data(), error_.data());
      series_since_ -= length;
      origin_ = end;
      since_ = 0;
      return {};
    }
    if (budget.is_hopeless(taken, since_, length)) return failure(time(), budget.hopeless(name()));
    if (taken == budget.steps())
      return failure(time(), budget.exceeded(system_, name(), settings_, time(), y_.data(), taken));
    y_ = end_state_;
    since_ = series_since_ + extent_;
    has_series_ = inputs_changed = false;
  }
  return {};
}

// Makes a series from the present state. It has fewer orders if these suffice for the time `aim`, s. Returns
// the reason of a failure, or null.
const char* Taylor::make_series(double aim) {
  if (!slope_known_ && !series_.set_slope(y_.data(), force_coefficients(since_, 0))) {
    system_.right_hand_side(time(), y_.data(), error_.data());  // identifies the joint
    return reasons::not_finite;
  }
  error_weights_.evaluate(y_.data(), weights_.data());
  double extent = expand(aim);
  while (std::isnan(extent)) {
    unit_ *= smaller_unit;
    if (unit_ < smallest_unit) return reasons::not_finite;
    extent = expand(aim);
  }
  statistics_.evaluations += series_.order();
  extent_ = std::min({extent, growth * series_.unit(), longest_});
  if (series_.order() < order_) extent_ = std::min(extent_, aim);
  series_since_ = since_;
  for (;;) {
    if (!(extent_ > smallest_step(since_, since_ + extent_))) return reasons::step_too_small_or_not_finite;
    const double error = error_at_extent();
    if (error <= 1) break;
    ++statistics_.rejected;
    ++statistics_.evaluations;
    const double factor = safety * std::pow(error, -1.0 / (series_.order() + 1));
    extent_ *= factor > reduction ? std::min(factor, safety) : reduction;
  }
  unit_ = extent_;
  has_series_ = slope_known_ = true;
  ++statistics_.steps;
  statistics_.step_size = extent_;
  return nullptr;
}

// Computes the coefficients. Returns the extent, s, by the last terms; NaN: a coefficient is not finite.
double Taylor::expand(double aim) {
  series_.start(y_.data(), unit_);
  const bool held = !system_.has_input_slopes();
  while (series_.order() < order_ && !suffices(aim))
    series_.extend(held ? no_forces_.data() : force_coefficients(since_, series_.order()));
  return extent_of_terms();
}

// Whether the last terms of the series are negligible at the time `aim`, s.
bool Taylor::suffices(double aim) const {
  if (series_.order() < lowest_order || !(aim < growth * unit_)) return false;
  const double s = aim / unit_;
  const int last = series_.order();
  return norm(series_.coefficient(last)) * std::pow(s, last) < negligible &&
         norm(series_.coefficient(last - 1)) * std::pow(s, last - 1) < negligible;
}

// Time, s, at which the last terms reach the tolerance; NaN: a coefficient is not finite.
double Taylor::extent_of_terms() const {
  double logarithm = std::numeric_limits<double>::infinity();
  for (int k = series_.order(); k > series_.order() - last_orders; --k) {
    const double size = norm(series_.coefficient(k));
    if (!std::isfinite(size)) return std::numeric_limits<double>::quiet_NaN();
    logarithm = std::min(logarithm, -std::log(size) / k);
  }
  return std::exp(logarithm) * series_.unit();
}

// Local error from the difference of the slopes at the extent, which grows with time^order(). Leaves the
// slope for the next series.
double Taylor::error_at_extent() {
  series_.evaluate(extent_, end_state_.data(), error_.data());
  const double since = series_since_ + extent_;
  if (!series_.set_slope(end_state_.data(), force_coefficients(since, 0)))
    return std::numeric_limits<double>::infinity();
  const double factor = extent_ / (series_.order() + 1);
  for (std::size_t i = 0; i < error_.size(); ++i) error_[i] = factor * (error_[i] - series_.slope()[i]);
  return statistics_.error_estimate = norm(error_.data());
}

// Coefficients of order `order` of all joint forces, in powers of the series' time in its unit.
const double* Taylor::force_coefficients(double since, int order) {
  const int first = system_.input_layout().tau.begin;
  if (order == 0 && !system_.has_input_slopes()) return &system_.inputs()[static_cast<std::size_t>(first)];
  if (order > InputLayout::highest_order) return no_forces_.data();
  double factor = 1;
  for (int k = 1; k <= order; ++k) factor *= unit_ / k;
  for (int i = 0; i < system_.plan().nv; ++i)
    forces_[i] = factor * system_.input_derivative(origin_ + since, first + i, order);
  return forces_.data();
}

void Taylor::save(std::vector<unsigned char>& bytes) const {
  ByteWriter writer(bytes);
  put_header(writer, system_, settings_, SolverMethod::taylor);
  writer.put(origin_);
  writer.put(since_);
  writer.put(y_.data(), y_.size());
  writer.put(unit_);
  writer.put(has_series_);
  writer.put(series_since_);
  writer.put(extent_);
  writer.put(series_.unit());
  writer.put<std::int32_t>(series_.order());
  writer.put(series_.saved(), series_.room());
  put(writer, statistics_);
}

bool Taylor::restore(const unsigned char* bytes, std::size_t size) {
  ByteReader reader(bytes, size);
  if (!has_header(reader, system_, settings_, SolverMethod::taylor)) return false;
  double origin = 0, since = 0, unit = 0, series_since = 0, extent = 0, series_unit = 0;
  unsigned char has_series = 0;
  std::int32_t order = 0;
  std::vector<double> y(y_.size()), coefficients(series_.room());
  Statistics statistics;
  reader.get(origin);
  reader.get(since);
  reader.get(y.data(), y.size());
  reader.get(unit);
  reader.get(has_series);
  reader.get(series_since);
  reader.get(extent);
  reader.get(series_unit);
  reader.get(order);
  reader.get(coefficients.data(), coefficients.size());
  get(reader, statistics);
  const bool possible = has_series <= 1 && order >= 0 && order <= order_ && unit > 0 && series_unit > 0;
  if (!reader.finished() || !possible || !std::isfinite(origin) || !std::isfinite(since)) return false;
  origin_ = origin;
  since_ = since;
  y_.swap(y);
  unit_ = unit;
  has_series_ = has_series;
  slope_known_ = false;
  series_since_ = series_since;
  extent_ = extent;
  series_.restore(order, series_unit, coefficients.data());
  if (has_series_) series_.evaluate(extent_, end_state_.data(), error_.data());
  statistics_ = statistics;
  return true;
}

}  // namespace

[[gnu::cold]] std::unique_ptr<Integrator> make_taylor(System& system, const SolverSettings& settings) {
  return std::make_unique<Taylor>(system, settings);
}

}  // namespace redysim
