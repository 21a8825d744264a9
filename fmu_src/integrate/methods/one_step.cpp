#include "integrate/methods/one_step.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "integrate/methods/state_bytes.hpp"
#include "integrate/methods/step_budget.hpp"
#include "model/number.hpp"

namespace redysim {

using namespace sundials;

OneStep::OneStep(System& system, const SolverSettings& settings, Scratch scratch, SolverMethod method,
                 int error_order, double tightening)
    : system_(system),
      settings_(settings),
      error_weights_(system, tightening * settings.rtol, tightening * settings.atol),
      control_(error_order, settings.max_step),
      scratch_(std::move(scratch)),
      result_(data(scratch_->vectors[1])),
      candidate_(data(scratch_->vectors[2])),
      y_(static_cast<std::size_t>(system.size())),
      slope_(y_),
      method_(method),
      error_order_(error_order) {}

bool OneStep::keep(double end, const double* y, double h, double error) {
  if (passes_contact(end, y, h)) return false;
  control_.accepted(h, error);
  ++statistics_.steps;
  statistics_.step_size = h;
  statistics_.error_estimate = settings_.max_rhs > 0 ? std::max(error, statistics_.error_estimate) : error;
  return true;
}

bool OneStep::repeat(double end, double& h, double error) {
  ++statistics_.rejected;
  h = control_.rejected(h, error);
  return !(h < smallest_step(end, end_));
}

bool OneStep::close(double time, double* y) {
  return !system_.has_constraints() ||
         system_.project(absolute(time), y, nullptr, evaluated_candidate()) == Status::ok;
}

Outcome OneStep::start(double time, const double* y) {
  origin_ = time;
  since_ = 0;
  std::copy_n(y, y_.size(), y_.begin());
  needs_first_step_ = true;
  slope_known_ = false;
  statistics_ = {};
  examine_loops();
  forget_choice();
  return check_start(time, y_);
}

// Loops are overconstrained if the rows that are independent at the start close them at another
// configuration, too. Otherwise dependent rows show a singular configuration.
void OneStep::examine_loops() {
  rank_ = 0;
  starts_singular_ = false;
  if (system_.plan().loops.empty()) return;
  std::copy(y_.begin(), y_.end(), candidate_);
  const bool possible = system_.slope_within_step(time(), candidate_, result_) == Status::ok;
  const int rank = system_.independent_rows();
  if (possible && rank == system_.rows()) return;
  system_.hold_rank(true);
  double far = 0.02;  // in units of the joints
  for (int i = 0; i < system_.simple(); ++i) candidate_[i] += (far *= -0.97) * system_.scales()[i];
  const bool closed = possible && system_.close_loops(time(), candidate_);
  system_.hold_rank(false);
  starts_singular_ = !closed;
  if (closed) rank_ = rank;
}

void OneStep::set_state(const double* y) {
  std::copy_n(y, y_.size(), y_.begin());
  slope_known_ = false;
}

void OneStep::expect_step(double step) {
  control_.start(step);
  needs_first_step_ = false;
}

bool OneStep::first_step_from_here() {
  ++statistics_.evaluations;
  if (system_.right_hand_side(time(), y_.data(), slope_.data()) != Status::ok) return false;
  slope_known_ = true;
  ++statistics_.evaluations;
  const double step = first_step(system_, error_weights_, error_order_ - 1, time(), y_.data(), slope_.data(),
                                 control_.step_limit(), scratch_->first_step);
  if (!(step > 0)) return false;
  control_.start(step);
  return true;
}

double OneStep::step_from(double since, const double* y) {
  const double step = std::min(control_.step_for(farthest_ - since), touch_);
  touch_ = std::numeric_limits<double>::max();
  searched_from_ = since;
  // If a step leaves a contact after its first stage, the error estimate contains only 1/74 of the error of
  // the result (order 5): steps are therefore shortened before.
  return system_.plan().has_contacts() ? system_.step_to_touch(absolute(since), y, step, true) : step;
}

// The search for contacts assumes constant joint accelerations. If these change, a step may still enter and
// leave a contact: it is then repeated up to the touch-down.
bool OneStep::passes_contact(double since, const double* y, double h) {
  if (!system_.plan().has_contacts()) return false;
  const double touch = system_.passed_touch(absolute(since), y, h);
  if (!(touch < h)) return false;
  if (affordable_steps() < 2) {  // one step to the contact, one from it
    loosen();
    return false;
  }
  touch_ = touch;
  ++statistics_.rejected;
  return true;
}

OneStep::Flag OneStep::attempt() {
  // the search for contacts needs the slope before the first stage
  if (!slope_known_ && system_.plan().has_contacts()) {
    ++statistics_.evaluations;
    slope_known_ = system_.right_hand_side(time(), y_.data(), slope_.data()) == Status::ok;
  }
  const Flag flag = run(step_from(since_, y_.data()));
  release_rank();
  // inner steps may violate a loop slightly near a singular position, the last one must not
  return flag == Flag::done && system_.loops_are_violated() ? Flag::not_closed : flag;
}

OneStep::Flag OneStep::run(double h) {
  reached_ = since_;
  std::copy(y_.begin(), y_.end(), result_);
  Flag flag = Flag::done;
  for (long taken = 0; flag == Flag::done && reached_ < end_; ++taken)
    flag = taken < allowed_ ? take_step(h) : Flag::step_limit;
  return flag;
}

// `h`: step size of the first attempt, on return of the next step.
OneStep::Flag OneStep::take_step(double& h) {
  if (!begin_step(h)) return Flag::not_finite;
  for (;;) {
    const double left = end_ - reached_;
    h = std::max(h, left / affordable_steps());
    const double beyond = h - left, rounding = smallest_step(reached_, end_);
    if (beyond > -rounding && (farthest_ == end_ || beyond < rounding)) h = left;
    const double end = h == left ? end_ : reached_ + h, error = attempt_error(h);
    if (!(error <= 1) && !must_do(h)) {
      if (!repeat(end, h, error)) return Flag::too_short;
      continue;
    }
    if (!std::isfinite(error)) return Flag::not_finite;
    if (error > 1) loosen();
    const double taken = h;
    if (!keep(end, candidate_, taken, error)) return Flag::other;
    if (end < end_) h = step_from(end, candidate_);
    return accept(end, taken);
  }
}

// Whether max_rhs allows too few steps for one shorter than h.
bool OneStep::must_do(double h) const {
  constexpr double shorter = 0.9;  // ratio from which on a repeated step is useful
  return (end_ - reached_) / affordable_steps() > shorter * h;
}

double OneStep::affordable() const {
  return settings_.max_rhs > 0
             ? settings_.max_rhs - static_cast<double>(statistics_.evaluations - evaluations_before_)
             : std::numeric_limits<double>::infinity();
}

std::string OneStep::last_decision() const {
  return "solver.max_rhs loosened the tolerance: error estimate " + rounded(statistics_.error_estimate) +
         " times the tolerance in the communication step to " + shown(time()) + " s";
}

OneStep::Flag OneStep::accept(double end, double) {
  if (!close(end, candidate_)) return Flag::not_closed;
  reached_ = end;
  std::copy_n(candidate_, y_.size(), result_);
  slope_known_ = false;
  return Flag::done;
}

// Repeats runs that passed a contact. A run leaves the state before a step that it cannot complete in
// result_.
OneStep::Flag OneStep::attempt_until_touch() {
  Flag flag = attempt();
  while (touch_ < std::numeric_limits<double>::max()) {
    since_ = searched_from_;
    std::copy_n(result_, y_.size(), y_.begin());
    flag = attempt();
  }
  return flag;
}

// A state too far from the loop constraints cannot be projected: shorter steps end closer to them.
OneStep::Flag OneStep::attempt_until_closed() {
  Flag flag = attempt_until_touch();
  for (int retry = 0; flag == Flag::not_closed && retry < 12 && affordable_steps() >= 2; ++retry) {
    ++statistics_.rejected;
    slope_known_ = false;
    control_.start(0.25 * std::min(control_.wanted(), end_ - since_));
    flag = attempt_until_touch();
  }
  return flag;
}

void OneStep::pause_after(long steps) {
  pause_after_ = steps;
  forget_goal();
}

void OneStep::begin_communication_step() {
  if (settings_.max_rhs > 0) statistics_.error_estimate = 0;
  loosened_ = false;
}

void OneStep::loosen() {
  if (!loosened_) ++statistics_.loosened;
  loosened_ = true;
}

Outcome OneStep::advance(double end, bool inputs_changed) {
  if (end == time()) return {};
  if (!is_later(end, time())) return failure(time(), reasons::end_not_later);
  if (inputs_changed) {
    slope_known_ = false;
    control_.forget_errors();
    if (system_.plan().has_motion() && !follow_motion(system_, time(), y_.data()))
      return failure(time(), reasons::motion_impossible);
  }
  const bool was_paused = since_ > 0 && end == goal_;
  if (!was_paused) evaluations_before_ = statistics_.evaluations;
  const bool step_guessed = needs_first_step_;
  if (needs_first_step_ && !first_step_from_here()) return failure(time(), reasons::not_finite_at_start);
  needs_first_step_ = false;

  goal_ = end;
  end_ = farthest_ = end - origin_;
  if (lies_in_last_step(inputs_changed)) {
    set_time(end_);
    return {};
  }
  const double origin_before = origin_, since_before = since_;
  std::copy(y_.begin(), y_.end(), scratch_->start.begin());
  leave_last_step();
  Outcome outcome = run_to_end(!step_guessed);
  if (outcome.ok) return {};
  needs_first_step_ = true;
  slope_known_ = false;
  origin_ = origin_before;
  since_ = since_before;
  std::copy(scratch_->start.begin(), scratch_->start.end(), y_.begin());
  return outcome;
}

// Runs until the end of the advance or until a pause is due. `may_choose`: false if the step size is only a
// first guess, which is no basis for the choice of a table.
Outcome OneStep::run_to_end(bool may_choose) {
  StepBudget budget(since_, end_);
  const long pause = pause_after_ > 0 ? std::min(budget.steps(), pause_after_) : budget.steps();
  for (long taken = 0; taken < pause; may_choose = true) {
    if (may_choose) choose_table(end_ - since_);
    allowed_ = std::min({pause - taken, steps_between_choices(), StepBudget::long_interval});
    taken += allowed_;
    const Flag flag = attempt_until_closed();
    switch (end_of_run(flag, taken, budget)) {
      case RunEnd::arrived:
        arrive(end_);
        return {};
      case RunEnd::paused:
        arrive(reached());
        break;
      case RunEnd::hopeless:
        return failure(absolute(reached()), budget.hopeless(name()));
      case RunEnd::failed:
        return failure(absolute(reached()), reason_of(flag, budget));
    }
  }
  return {};
}

OneStep::RunEnd OneStep::end_of_run(Flag flag, long taken, StepBudget& budget) const {
  if (flag == Flag::done) return RunEnd::arrived;
  if (flag != Flag::step_limit) return RunEnd::failed;
  if (budget.is_hopeless(taken, reached(), end_)) return RunEnd::hopeless;
  return taken < budget.steps() ? RunEnd::paused : RunEnd::failed;
}

void OneStep::set_time(double since) {
  if (since == end_) {
    origin_ = goal_;
    since_ = 0;
  } else {
    since_ = since;
  }
}

void OneStep::arrive(double since) {
  std::copy_n(result_, y_.size(), y_.begin());
  set_time(since);
}

std::string OneStep::reason_of(Flag flag, const StepBudget& budget) {
  switch (flag) {
    case Flag::too_short:
      return reasons::step_too_small_or_not_finite;
    case Flag::not_closed:
      return settings_.max_rhs > 0 ? reasons::loops_open_within_max_rhs : reasons::loops_open;
    case Flag::not_finite:
      return settings_.max_rhs > 0 ? reasons::not_finite_within_max_rhs : reasons::not_finite;
    case Flag::step_limit:
      return budget.exceeded(system_, name(), settings_, absolute(reached()), result_, budget.steps());
    case Flag::below_rounding:
      return reasons::tolerance_below_rounding;
    default:
      return scratch_->message.reason();
  }
}

void OneStep::save(std::vector<unsigned char>& bytes) const {
  ByteWriter writer(bytes);
  put_header(writer, system_, settings_, method_);
  writer.put(origin_);
  writer.put(since_);
  writer.put(control_.wanted());
  writer.put(control_.previous_error());
  writer.put(needs_first_step_);
  writer.put(slope_known_);
  writer.put(rank_);
  writer.put(starts_singular_);
  writer.put(y_.data(), y_.size());
  writer.put(slope_.data(), slope_.size());
  writer.put(system_.searched().data(), system_.searched().size());
  put(writer, statistics_);
  put_choice(writer);
}

bool OneStep::get_choice(ByteReader& reader) { return reader.finished(); }

bool OneStep::restore(const unsigned char* bytes, std::size_t size) {
  ByteReader reader(bytes, size);
  if (!has_header(reader, system_, settings_, method_)) return false;
  double origin = 0, since = 0, wanted = 0, previous_error = 0;
  unsigned char fresh = 0, slope_known = 0, starts_singular = 0;
  int rank = 0;
  std::vector<double> y(y_.size()), slope(slope_.size()), searched(system_.searched().size());
  Statistics statistics;
  reader.get(origin);
  reader.get(since);
  reader.get(wanted);
  reader.get(previous_error);
  reader.get(fresh);
  reader.get(slope_known);
  reader.get(rank);
  reader.get(starts_singular);
  reader.get(y.data(), y.size());
  reader.get(slope.data(), slope.size());
  reader.get(searched.data(), searched.size());
  get(reader, statistics);
  const bool steps_possible = fresh == 1 || (wanted > 0 && previous_error > 0);
  if (!std::isfinite(origin) || !std::isfinite(since) || fresh > 1 || slope_known > 1 ||
      starts_singular > 1 || !steps_possible)
    return false;
  if (!get_choice(reader)) return false;

  forget_goal();
  origin_ = origin;
  since_ = since;
  control_.restore(wanted, previous_error);
  needs_first_step_ = fresh;
  slope_known_ = slope_known;
  rank_ = rank;
  starts_singular_ = starts_singular;
  y_.swap(y);
  slope_.swap(slope);
  system_.searched().swap(searched);
  statistics_ = statistics;
  return true;
}

}  // namespace redysim
