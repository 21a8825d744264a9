#include "integrate/methods/automatic.hpp"

#include <cmath>
#include <cstdio>
#include <utility>

#include "integrate/methods/cvode.hpp"
#include "integrate/methods/one_step.hpp"
#include "integrate/methods/state_bytes.hpp"
#include "integrate/methods/step_budget.hpp"
#include "model/read/number.hpp"

namespace redysim {
namespace {

void add(const Statistics& more, Statistics& sum) {
  sum.steps += more.steps;
  sum.rejected += more.rejected;
  sum.evaluations += more.evaluations;
  sum.jacobians += more.jacobians;
}

}  // namespace

Automatic::Automatic(System& system, const SolverSettings& settings, Room room)
    : system_(system), settings_(settings), room_(std::move(room)), radius_(system) {
  for (const Choice choice : {Choice::erk, Choice::dirk, Choice::bdf})
    if (!is_implicit(choice) || system.size() <= Tuning::implicit_from_start) integrator(choice);
}

Integrator& Automatic::integrator(Choice choice) {
  auto& method = methods_[static_cast<std::size_t>(choice)];
  if (!method) {
    method = made(choice);
    method->pause_after(pause_);
  }
  return *method;
}

std::unique_ptr<Integrator> Automatic::made(Choice choice) {
  if (choice == Choice::adams) return make_adams(system_, settings_, room_);
  if (choice == Choice::dirk) return make_dirk(system_, settings_, room_);
  if (choice == Choice::bdf) return make_bdf(system_, settings_, room_);
  return make_erk(system_, settings_, room_);
}

Outcome Automatic::start(double time, const double* y) {
  memory_ = {};
  memory_.mark_time = memory_.older_time = memory_.changed = time;
  std::fill_n(memory_.wait, choices, Tuning::first_wait);
  before_ = statistics_ = {};
  memory_.choice = memory_.home = static_cast<std::uint8_t>(Choice::adams);
  current_ = &integrator(choice());
  return current_->start(time, y);
}

double Automatic::jacobian_work() const {
  return Tuning::jacobian_column * (system_.nq() + system_.nv() + system_.layout().actuators());
}

double Automatic::work() const {
  return static_cast<double>(statistics_.evaluations) +
         jacobian_work() * static_cast<double>(statistics_.jacobians);
}

void Automatic::begin_account() {
  memory_.mark_work = memory_.older_work = memory_.sampled_work = work();
  memory_.mark_time = memory_.older_time = memory_.sampled = time();
  memory_.explicit_work = 0;
}

// Right-hand sides per second of the method in use, over its last two measurements.
double Automatic::cost() const { return (work() - memory_.older_work) / (time() - memory_.older_time); }

// Ends a measurement. If the method in use now costs more than its rival did in the last trial, the motion
// has become more difficult, and the trial has decided nothing.
void Automatic::end_measurement() {
  const double spent = work() - memory_.mark_work, passed = time() - memory_.mark_time;
  if (spent < Tuning::bucket) return;
  if (memory_.failed_cost > 0 && spent / passed > Tuning::overtaken * memory_.failed_cost &&
      work() - memory_.begun >= settled_work()) {
    double& due = memory_.due[memory_.rival];
    due = std::min(due, work() + std::max(Tuning::undecided_wait,
                                          Tuning::undecided_share * memory_.wait[memory_.rival]));
    memory_.failed_cost = 0;
  }
  const double kept = std::exp(-spent / Tuning::horizon);
  memory_.average_work = kept * memory_.average_work + spent;
  memory_.average_time = kept * memory_.average_time + passed;
  const double before = (memory_.mark_work - memory_.older_work) / (memory_.mark_time - memory_.older_time);
  const double change = before * passed / spent;  // NaN after the first measurement
  memory_.steady = !(change > Tuning::steady_cost || change * Tuning::steady_cost < 1);
  memory_.older_work = memory_.mark_work;
  memory_.older_time = memory_.mark_time;
  memory_.mark_work = work();
  memory_.mark_time = time();
}

void Automatic::count() {
  statistics_ = current_->statistics();
  add(before_, statistics_);
}

// What the tolerance allows, or the last step.
double Automatic::step() const {
  return is_multistep(choice()) ? current_->statistics().step_size
                                : static_cast<const OneStep*>(current_)->allowed_step();
}

// For how many steps of the one-step method the inputs are expected to be held: as long as before, or as long
// as they are held already.
double Automatic::steps_held(double end, double span) const {
  const double expected = expected_hold(end);
  double own = step();
  if (is_multistep(choice())) {
    double known = memory_.step[static_cast<int>(one_step_like(choice()))];
    if (known == 0) known = memory_.step[static_cast<int>(Choice::erk)];
    own = known > 0 ? known : Tuning::explicit_stages * own;  // of equal cost
  }
  return expected / (own > 0 ? std::min(own, span) : span);
}

// Whether stability limits the steps of the explicit method in use.
bool Automatic::limited_by_stability(double radius, double of_hold) const {
  if (choice() == Choice::adams)
    return static_cast<const Cvode*>(current_)->stability_used(radius) > Tuning::adams_stability ||
           (is_stuck() && step() * radius > Tuning::stuck_stability);
  return static_cast<const OneStep*>(current_)->stability_used(radius) >
         (of_hold >= Tuning::long_hold ? Tuning::erk_stability_held : Tuning::erk_stability);
}

// Continues with another method from the same state.
void Automatic::use(Choice choice) {
  if (choice == this->choice()) return;
  const double time = current_->time(), known = memory_.step[static_cast<int>(choice)];
  memory_.step[memory_.choice] = step();
  add(current_->statistics(), before_);
  Integrator& next = integrator(choice);
  next.start(time, current_->state());
  if (!is_multistep(choice) && known > 0) static_cast<OneStep&>(next).expect_step(known);
  current_ = &next;
  memory_.choice = memory_.home = static_cast<std::uint8_t>(choice);
  memory_.oscillation = 0;
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

Outcome Automatic::advance(double end, bool inputs_changed) {
  if (!is_later(end, time())) return current_->advance(end, inputs_changed);
  const double span = end - time();
  if (inputs_changed) note_change();
  // a multistep method does not pay for its restarts
  if (is_multistep(choice()) && !restarts_pay(end, span)) leave_multistep();
  if (inputs_changed || !is_periodic()) consider(end, span);
  StepBudget budget(time(), end);
  const long before = statistics_.steps;
  bool changed = inputs_changed;
  unsigned failed = 0;  // methods, at `failed_at`
  double failed_at = time();
  while (time() < end) {
    Outcome outcome = current_->advance(end, changed);
    count();
    if (!outcome.ok) {
      if (time() > failed_at) failed = 0;
      failed_at = time();
      if (!replace_failed(failed)) return outcome;
      continue;
    }
    changed = false;
    const long taken = statistics_.steps - before;
    if (budget.is_hopeless(taken, time(), end)) return failure(time(), budget.hopeless(name()));
    if (taken > budget.steps()) return failure(time(), budget.exceeded(system_, name(), time(), state()));
    if (is_pause_due(taken)) return {};
    if (time() < end) consider(end, span);
  }
  return {};
}

// Continues with a method that has not failed here; the one-step methods first, whose steps shrink best.
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

// A trial goes on with the one-step method.
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

std::string Automatic::last_decision() const {
  static constexpr const char* names[choices] = {"erk", "adams", "dirk", "bdf"};
  const char *method = names[static_cast<int>(note_.method)], *other = names[static_cast<int>(note_.other)];
  const std::string at = shown(note_.time), cost = rounded(note_.cost), rival = rounded(note_.other_cost);
  char text[200];
  const auto print = [&text](const char* sentence, auto... parts) {
    std::snprintf(text, sizeof text, sentence, parts...);
  };
  if (note_.event == Event::tried)
    print("auto tries %s instead of %s at %s s", method, other, at.c_str());
  else if (note_.event == Event::restarts)
    print("auto continues with %s at %s s: inputs change too often for %s", other, at.c_str(), method);
  else if (note_.event == Event::replaces)
    print("auto continues with %s at %s s: %s failed", other, at.c_str(), method);
  else
    print("auto %s %s at %s s: %s right-hand sides per second, %s took %s",
          note_.event == Event::stays ? "keeps" : "returns from", method, at.c_str(), cost.c_str(), other,
          rival.c_str());
  return text;
}

void Automatic::save(std::vector<unsigned char>& bytes) const {
  ByteWriter writer(bytes);
  put(writer, state_header(system_, settings_, SolverMethod::automatic));
  each_part(memory_, [&writer](const auto& part) { writer.put(part); });
  put(writer, before_);
  current_->save(bytes);
}

bool Automatic::restore(const unsigned char* bytes, std::size_t size) {
  ByteReader reader(bytes, size);
  if (!matches(reader, state_header(system_, settings_, SolverMethod::automatic))) return false;
  Memory memory;
  Statistics before;
  each_part(memory, [&reader](auto& part) { reader.get(part); });
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

std::unique_ptr<Integrator> make_automatic(System& system, const SolverSettings& settings, Room room) {
  return std::make_unique<Automatic>(system, settings, std::move(room));
}

}  // namespace redysim
