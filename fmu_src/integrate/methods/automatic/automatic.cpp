#include "integrate/methods/automatic/automatic.hpp"

#include <algorithm>
#include <utility>

#include "integrate/methods/slope_time.hpp"
#include "integrate/methods/state_bytes.hpp"

namespace redysim {

Automatic::Automatic(System& system, const SolverSettings& settings, Scratch scratch)
    : system_(system), settings_(settings), scratch_(std::move(scratch)), radius_(system) {
  for (int k = 0; k < choices; ++k) {
    const Choice choice = static_cast<Choice>(k);
    slope_times_[k] = redysim::slope_time(system, method_of[k]);
    if (choice != Choice::exponential &&
        (!is_implicit(choice) || system.size() <= Tuning::implicit_from_start))
      integrator(choice);
  }
}

Integrator& Automatic::integrator(Choice choice) {
  auto& method = methods_[static_cast<std::size_t>(choice)];
  if (!method) {
    method = made(choice);
    method->pause_after(pause_of(choice));
  }
  return *method;
}

std::unique_ptr<Integrator> Automatic::made(Choice choice) {
  if constexpr (has_series)
    if (choice == series) return make_taylor(system_, settings_);
  if (choice == Choice::adams) return make_adams(system_, settings_, scratch_);
  if (choice == Choice::dirk) return make_dirk(system_, settings_, scratch_);
  if (choice == Choice::bdf) return make_bdf(system_, settings_, scratch_);
  if (choice == Choice::exponential) return make_exponential(system_, settings_, scratch_);
  return make_erk(system_, settings_, scratch_);
}

Outcome Automatic::start(double time, const double* y) {
  memory_ = {};
  memory_.mark_time = memory_.older_time = memory_.changed = time;
  std::fill_n(memory_.wait, choices, Tuning::first_wait);
  before_ = statistics_ = {};
  current_ = &integrator(first_choice);
  memory_.choice = memory_.home = static_cast<std::uint8_t>(first_choice);
  return current_->start(time, y);
}

// Continues with another method from the same state.
void Automatic::use(Choice choice) {
  if (choice == this->choice()) return;
  const double time = current_->time(), known = memory_.step[static_cast<int>(choice)];
  memory_.step[memory_.choice] = step();
  before_.add(of_method_in_use());
  Integrator& next = integrator(choice);
  next.start(time, current_->state());
  if (controls_step(choice) && known > 0) static_cast<OneStep&>(next).expect_step(known);
  current_ = &next;
  memory_.choice = memory_.home = static_cast<std::uint8_t>(choice);
  memory_.oscillation = memory_.limited = 0;
  count();
  memory_.begun = work();
}

void Automatic::note_change() {
  const double held = time() - memory_.changed;
  memory_.changed = time();
  memory_.interval_work = work() - memory_.interval_begun;
  memory_.interval_begun = work();
  if (held > 0)
    memory_.hold = memory_.hold == 0 || held < memory_.hold ? held : std::sqrt(memory_.hold * held);
}

void Automatic::consider_inputs(double end, bool changed) {
  const double span = end - time();
  if (changed) note_change();
  // a multistep method does not pay off with its restarts
  if (is_multistep(choice()) && steps_held(end, span) < Tuning::held_for_restart) leave_multistep();
  if (changed || !is_periodic()) consider(end, span);
}

Outcome Automatic::advance(double end, bool inputs_changed) {
  const bool is_interpolation = !inputs_changed && !is_trial() && current_->reaches(end);
  if (is_interpolation || !is_later(end, time())) {
    Outcome outcome = current_->advance(end, inputs_changed);
    // a loop that cannot be closed within a step may be closed at the end of a shorter one
    if (outcome.ok || !is_interpolation) return outcome;
  }
  return take_steps(end, inputs_changed);
}

Outcome Automatic::take_steps(double end, bool inputs_changed) {
  const double span = end - time();
  consider_inputs(end, inputs_changed);
  Attempt attempt(*this, end);
  const std::int64_t before = statistics_.steps;
  unsigned failed = 0;  // bits of the methods that failed at `failed_at`, or with an exhausted budget
  double failed_at = time();
  bool is_hopeless = false;  // for some method
  while (time() < end) {
    Outcome outcome = current_->advance(end, inputs_changed);
    count();
    if (!outcome.ok) {
      if (time() > failed_at) failed = attempt.exhausted;
      failed_at = time();
      if (!replace_failed(failed)) return outcome;
      continue;
    }
    inputs_changed = false;
    const std::int64_t taken = statistics_.steps - attempt.steps_before;
    const bool stalls = attempt.budget.is_hopeless(taken, time(), end);
    is_hopeless = is_hopeless || stalls;
    if (stalls || attempt.is_over(*this, taken)) {
      if (replace_exhausted(attempt, end)) continue;
      return failure(time(), is_hopeless ? attempt.budget.hopeless(name())
                                         : attempt.budget.exceeded(system_, "auto", settings_, time(),
                                                                   state(), statistics_.steps - before));
    }
    if (is_pause_due(statistics_.steps - before)) break;
    if (!tries_bdf_late(attempt, taken, span) && time() < end) consider(end, span);
  }
  readmit(attempt.exhausted);
  return {};
}

// Continues with a method that has not failed here: one-step methods first, since their steps can shrink
// most.
bool Automatic::replace_failed(unsigned& failed) {
  const Choice former = choice();
  failed |= 1U << memory_.choice;
  for (const Choice next : {Choice::dirk, Choice::erk, Choice::bdf, Choice::adams}) {
    if ((failed >> static_cast<unsigned>(next) & 1U) != 0) continue;
    use(next);
    note(Event::replaces, former, next, 0, 0);
    memory_.due[static_cast<int>(former)] = work() + Tuning::longest_wait;
    memory_.measuring = memory_.extensions = 0;
    memory_.average_work = memory_.average_time = 0;
    begin_account();
    return true;
  }
  return false;
}

Automatic::Attempt::Attempt(const Automatic& of, double end) : budget(of.time(), end) { begin(of, end); }

void Automatic::Attempt::begin(const Automatic& of, double end) {
  budget = StepBudget(of.time(), end);
  steps_before = of.statistics_.steps;
  work_before = of.work();
}

bool Automatic::Attempt::is_over(const Automatic& of, std::int64_t taken) const {
  const bool is_expensive = is_implicit(of.choice()) && of.work() - work_before > work_limit;
  return !of.is_trial() && (taken > budget.steps() || is_expensive);
}

// Continues with a method whose budget is not exhausted.
bool Automatic::replace_exhausted(Attempt& attempt, double end) {
  const int former = memory_.choice;
  const double spent = work() - attempt.work_before;
  const bool is_second = (attempt.exhausted >> static_cast<unsigned>(former) & 1U) != 0;
  if (is_second || attempt.budget.is_too_small_for(settings_.max_step) || !replace_failed(attempt.exhausted))
    return false;
  memory_.due[former] = std::numeric_limits<double>::infinity();  // until `readmit`
  attempt.begin(*this, end);
  attempt.work_limit = std::min(attempt.work_limit, spent);
  return true;
}

// Tries bdf once if an explicit method has taken a large part of the step budget.
bool Automatic::tries_bdf_late(Attempt& attempt, std::int64_t taken, double span) {
  if (attempt.tried_bdf || is_implicit(choice()) || is_trial() ||
      Tuning::explicit_part * taken <= attempt.budget.steps())
    return false;
  attempt.tried_bdf = true;
  begin_trial(Choice::bdf, span);
  return true;
}

// Methods that exhausted a budget may be tried again.
void Automatic::readmit(unsigned exhausted) {
  for (int k = 0; k < choices; ++k)
    if ((exhausted >> static_cast<unsigned>(k) & 1U) != 0) memory_.due[k] = work() + Tuning::longest_wait;
}

// A trial continues with the one-step method.
void Automatic::leave_multistep() {
  const std::uint8_t home = memory_.home;
  const bool was_trial = is_trial();
  note(Event::restarts, choice(), one_step_like(choice()), 0, 0);
  use(one_step_like(choice()));
  if (was_trial)
    memory_.home = home;
  else
    memory_.average_work = memory_.average_time = 0;
  memory_.measuring = memory_.extensions = 0;
  begin_account();
}

void Automatic::consider(double end, double span) {
  if (!(time() > memory_.mark_time)) return;
  // costs are measured over whole intervals between input changes
  const bool within_hold = is_periodic() && time() != memory_.changed;
  if (is_trial()) return follow_trial(within_hold);
  if (within_hold && (is_implicit(choice()) || work() - memory_.mark_work < Tuning::long_account ||
                      work() - memory_.interval_begun < Tuning::long_interval * memory_.interval_work))
    return;
  end_measurement();
  const Outlook outlook = {span, steps_held(end, span), expected_hold(end)};
  const bool has_relative = choice() != Choice::exponential;
  if (!within_hold && has_relative &&
      (is_multistep(choice()) ? consider_one_step(outlook) : consider_multistep(outlook)))
    return;
  // no method is cheaper than one explicit step per input
  const bool is_settled = work() - memory_.begun >= settled_work();
  if (is_settled && work() >= memory_.estimate_due && outlook.steps >= Tuning::held_for_estimate)
    consider_stiffness(outlook);
}

void Automatic::save(std::vector<unsigned char>& bytes) const {
  ByteWriter writer(bytes);
  put_header(writer, system_, settings_, SolverMethod::automatic);
  AutomaticMemory::each_part(memory_, [&writer](const auto& part) { writer.put(part); });
  put(writer, before_);
  current_->save(bytes);
}

bool Automatic::restore(const unsigned char* bytes, std::size_t size) {
  ByteReader reader(bytes, size);
  if (!has_header(reader, system_, settings_, SolverMethod::automatic)) return false;
  AutomaticMemory memory;
  Statistics before;
  AutomaticMemory::each_part(memory, [&reader](auto& part) { reader.get(part); });
  get(reader, before);
  if (!reader.good() || std::max({memory.choice, memory.home, memory.rival}) >= choices) return false;
  Integrator& next = integrator(static_cast<Choice>(memory.choice));
  if (!next.restore(reader.rest(), reader.left())) return false;
  current_ = &next;
  memory_ = memory;
  before_ = before;
  count();
  return true;
}

std::unique_ptr<Integrator> make_automatic(System& system, const SolverSettings& settings, Scratch scratch) {
  return std::make_unique<Automatic>(system, settings, std::move(scratch));
}

}  // namespace redysim
