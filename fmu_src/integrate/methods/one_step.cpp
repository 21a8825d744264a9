#include "integrate/methods/one_step.hpp"

#include <arkode/arkode.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "integrate/system/state_bytes.hpp"

namespace redysim {

using namespace sundials;

OneStep::OneStep(System& system, const SolverSettings& settings, SolverMethod method, int error_order,
                 double tightening)
    : system_(system),
      settings_(settings),
      error_weights_(system, tightening * settings.rtol, tightening * settings.atol),
      control_(error_order, settings.max_step),
      start_(make_vector(system.size(), context_)),
      result_(make_vector(system.size(), context_)),
      y_(static_cast<std::size_t>(system.size())),
      slope_(y_),
      y_before_(y_),
      method_(method),
      error_order_(error_order),
      room_(system.size()),
      largest_step_(settings.max_step > 0 ? settings.max_step : std::numeric_limits<double>::max()) {}

int OneStep::weights(N_Vector y, N_Vector weights, void* self) {
  static_cast<OneStep*>(self)->error_weights_.evaluate(data(y), data(weights));
  return 0;
}

int OneStep::adapt(N_Vector, double t, double h, double, double, double error, double, double, int, int,
                   double* next, void* self_pointer) {
  OneStep& self = *static_cast<OneStep*>(self_pointer);
  // what is too long for Newton's iteration is too long
  const long unsolved = self.unsolved();
  if (unsolved != self.unsolved_before_) {
    self.statistics_.rejected += unsolved - self.unsolved_before_;
    self.unsolved_before_ = unsolved;
    self.control_.limit(h);
  }
  if (error <= 1) {
    self.control_.accepted(h, error);
    ++self.statistics_.steps;
    self.statistics_.step_size = h;
    self.statistics_.error_estimate = error;
    const double remaining = self.end_ - t;
    *next = remaining > 0 ? self.control_.step_for(remaining) / sundials_safety : h;
    return 0;
  }
  // a slope that failed at the step's start stays failed, whatever the step
  self.stage_failed_ = false;
  ++self.statistics_.rejected;
  *next = self.control_.rejected(h, error) / sundials_safety;
  self.step_at_floor_ = *next < smallest_step(t, self.end_);
  return self.step_at_floor_ ? 1 : 0;
}

int OneStep::complete_step(double time, N_Vector y, void* self_pointer) {
  OneStep& self = *static_cast<OneStep*>(self_pointer);
  self.skip_slope_ = time == self.end_;
  if (self.warming_up_ || !self.system_.has_loops()) return 0;
  const Status status = self.system_.project(self.absolute(time), data(y), nullptr);
  self.projection_failed_ = status != Status::ok;
  return static_cast<int>(status);
}

Outcome OneStep::start(double time, const double* y) {
  origin_ = time;
  since_ = 0;
  std::copy_n(y, y_.size(), y_.begin());
  fresh_ = true;
  slope_known_ = false;
  statistics_ = {};
  forget_choice();
  if (!std::isfinite(time)) return failure(time, "the start time is not a number");
  for (double value : y_)
    if (!std::isfinite(value)) return failure(time, "the start state is not finite");
  return {};
}

void OneStep::expect_step(double step) {
  control_.start(step);
  fresh_ = false;
}

bool OneStep::first_step_from_here() {
  ++statistics_.evaluations;
  if (system_.right_hand_side(time(), y_.data(), slope_.data()) != Status::ok) return false;
  slope_known_ = true;
  ++statistics_.evaluations;
  const double step = first_step(system_, error_weights_, error_order_ - 1, time(), y_.data(), slope_.data(),
                                 largest_step_, room_);
  if (!(step > 0)) return false;
  control_.start(step);
  return true;
}

int OneStep::attempt() {
  skip_slope_ = stage_failed_ = step_at_floor_ = projection_failed_ = false;
  unsolved_before_ = unsolved();
  std::copy(y_.begin(), y_.end(), data(start_));
  const int flag = run(control_.step_for(end_ - since_));
  // on the way a loop may open a little where it passes a singular position, at the end it is closed
  if (flag < 0 || !system_.loops_are_lost()) return flag;
  projection_failed_ = true;
  return ARK_POSTPROCESS_STEP_FAIL;
}

// A state too far off to be projected: shorter steps end closer to the closed loops.
int OneStep::attempt_until_closed() {
  int flag = attempt();
  for (int retry = 0; flag == ARK_POSTPROCESS_STEP_FAIL && retry < 12; ++retry) {
    ++statistics_.rejected;
    control_.start(0.25 * std::min(control_.wanted(), end_ - since_));
    flag = attempt();
  }
  return flag;
}

Outcome OneStep::advance(double end, bool inputs_changed) {
  if (end == time()) return {};
  if (!(end > time()) || !std::isfinite(end))
    return failure(time(), "the end of the step is not a later time");
  if (inputs_changed) {
    slope_known_ = false;
    control_.forget_errors();
    if (system_.plan().has_motion() && !follow_motion(system_, time(), y_.data()))
      return failure(time(), "the joints cannot follow the prescribed motion");
  }
  if (fresh_ && !first_step_from_here())
    return failure(time(), "the accelerations cannot be computed at the start of the step");
  bool guessed = fresh_;  // a first guess of the step decides nothing
  fresh_ = false;

  goal_ = end;
  end_ = end - origin_;
  const long bound = allowed_steps(end_ - since_),
             allowed = pause_after_ > 0 ? std::min(bound, pause_after_) : bound;
  const double origin_before = origin_, since_before = since_;
  std::copy(y_.begin(), y_.end(), y_before_.begin());
  Pace pace(since_);
  for (long left = allowed; left > 0;) {
    if (!guessed) choose_table(end_ - since_);
    guessed = false;
    const long some = steps_between_choices();
    allowed_ = std::min({left, some > 0 ? some : left, Pace::looks_after});
    left -= allowed_;
    const int flag = attempt_until_closed();
    const bool halted = flag == ARK_TOO_MUCH_WORK;
    const bool hopeless = halted && pace.is_hopeless(allowed - left, allowed, reached(), end_);
    if (flag < 0 && (hopeless || !(halted && (left > 0 || allowed == pause_after_)))) {
      fresh_ = true;
      slope_known_ = false;
      const Outcome outcome = hopeless && left > 0
                                  ? failure(absolute(reached()), Pace::sentence(bound, name()))
                                  : explain(flag, bound);
      origin_ = origin_before;
      since_ = since_before;
      std::copy(y_before_.begin(), y_before_.end(), y_.begin());
      return outcome;
    }
    arrive(halted ? reached() : end_);
    if (!halted) break;
  }
  return {};
}

void OneStep::arrive(double since) {
  std::copy_n(data(result_), y_.size(), y_.begin());
  if (since == end_) {
    origin_ = goal_;
    since_ = 0;
  } else {
    since_ = since;
  }
  const double* slope = last_slope();
  slope_known_ = slope != nullptr;
  if (slope_known_) std::copy_n(slope, slope_.size(), slope_.begin());
}

Outcome OneStep::explain(int flag, long allowed) {
  const double at = absolute(reached());
  if (step_at_floor_)
    return failure(at, "no step is small enough for the tolerance, or the accelerations are not finite");
  if (projection_failed_) return failure(at, "the loops cannot be closed");
  if (const char* known = reason(flag)) return failure(at, known);
  if (flag == ARK_RHSFUNC_FAIL || flag == ARK_UNREC_RHSFUNC_ERR)
    return failure(at, "the accelerations cannot be computed");
  if (flag == ARK_TOO_MUCH_WORK)
    return failure(at, too_many_steps(system_, allowed, name(), at, data(result_)));
  return failure(at, flag == ARK_TOO_MUCH_ACC ? tolerance_below_rounding : message_.reason());
}

void OneStep::save(std::vector<unsigned char>& bytes) const {
  StateWriter writer(bytes);
  put(writer, state_header(system_, settings_, method_));
  writer.put(origin_);
  writer.put(since_);
  writer.put(control_.wanted());
  writer.put(control_.previous_error());
  writer.put(fresh_);
  writer.put(slope_known_);
  writer.put(y_.data(), y_.size());
  writer.put(slope_.data(), slope_.size());
  put(writer, statistics_);
  put_choice(writer);
}

bool OneStep::get_choice(StateReader& reader) { return reader.finished(); }

bool OneStep::restore(const unsigned char* bytes, std::size_t size) {
  StateReader reader(bytes, size);
  if (!matches(reader, state_header(system_, settings_, method_))) return false;
  double origin = 0, since = 0, wanted = 0, previous_error = 0;
  unsigned char fresh = 0, slope_known = 0;
  std::vector<double> y(y_.size()), slope(slope_.size());
  Statistics statistics;
  reader.get(origin);
  reader.get(since);
  reader.get(wanted);
  reader.get(previous_error);
  reader.get(fresh);
  reader.get(slope_known);
  reader.get(y.data(), y.size());
  reader.get(slope.data(), slope.size());
  get(reader, statistics);
  const bool steps_possible = fresh == 1 || (wanted > 0 && previous_error > 0);
  if (!std::isfinite(origin) || !std::isfinite(since) || fresh > 1 || slope_known > 1 || !steps_possible)
    return false;
  if (!get_choice(reader)) return false;

  origin_ = origin;
  since_ = since;
  control_.restore(wanted, previous_error);
  fresh_ = fresh;
  slope_known_ = slope_known;
  y_.swap(y);
  slope_.swap(slope);
  statistics_ = statistics;
  return true;
}

}  // namespace redysim
