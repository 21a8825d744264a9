#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "integrate/methods/decision.hpp"
#include "integrate/methods/one_step.hpp"
#include "integrate/methods/phi_functions.hpp"
#include "integrate/methods/slope_time.hpp"
#include "integrate/methods/state_bytes.hpp"
#include "integrate/methods/step_budget.hpp"
#include "integrate/methods/tuning.hpp"
#include "integrate/system/spectral_radius.hpp"

// Chooses among the methods during the run (docs/solvers.md, constants in tuning.hpp).
//
// A method that promises to be cheaper is tried: it continues the run, and after its start its estimated CPU
// time per second of motion is compared with that of the method before it. If it is not cheaper, that method
// returns, and the next trial waits longer. Candidates are
//
// * multistep methods, where inputs are held for several steps of the one-step method;
// * implicit methods, where the spectral radius, estimated from time to time, shows that stability limits the
//   steps of an explicit one; then dirk or bdf instead of the other, and explicit ones where they promise it.
//
// Inputs that change again and again are part of the cost: it is then measured over whole intervals between
// changes. Where a method fails, the others continue in turn; the advance fails where all do.

namespace redysim {
namespace {

class Automatic final : public Integrator {
 public:
  Automatic(System& system, const SolverSettings& settings, Scratch scratch);

  Outcome start(double time, const double* y) override;
  void set_state(const double* y) override { current_->set_state(y); }
  Outcome advance(double end, bool inputs_changed) override;
  void pause_after(long steps) override {
    pause_after_ = steps;
    pause_ = steps > 0 ? std::min(steps, Tuning::steps_between_choices) : Tuning::steps_between_choices;
    for (int k = 0; k < choices; ++k)
      if (methods_[k]) methods_[k]->pause_after(pause_of(static_cast<Choice>(k)));
  }

  double time() const override { return current_->time(); }
  const double* state() const override { return current_->state(); }
  const Statistics& statistics() const override { return statistics_; }
  const char* name() const override { return current_->name(); }
  SolverMethod method() const override { return current_->method(); }

  long decisions() const override { return decisions_; }
  std::string last_decision() const override { return decision_.text(); }

  void save(std::vector<unsigned char>& bytes) const override;
  bool restore(const unsigned char* bytes, std::size_t size) override;

 private:
  using Event = Decision::Event;
  void note(Event event, Choice method, Choice other, double cost, double other_cost) {
    decision_ = {event, method, other, time(), cost, other_cost};
    ++decisions_;
  }

  Choice choice() const { return static_cast<Choice>(memory_.choice); }
  Integrator& integrator(Choice choice);
  long pause_of(Choice choice) const {
    return choice == Choice::exponential ? std::min(pause_, Tuning::exponential_between_choices) : pause_;
  }
  std::unique_ptr<Integrator> made(Choice choice);
  bool is_trial() const { return memory_.home != memory_.choice; }
  bool may_try(Choice choice) const { return work() >= memory_.due[static_cast<int>(choice)]; }
  double step() const;
  double steps_held(double end, double span) const;
  // Whether communication points do not limit the steps of the one-step method of the same kind.
  bool passes_ends() const { return is_series(choice()) || (!is_implicit(choice()) && erk().passes_ends()); }
  const OneStep& erk() const { return static_cast<const OneStep&>(*methods_[static_cast<int>(Choice::erk)]); }
  bool is_pause_due(long taken) const { return pause_after_ > 0 && taken + pause_ > pause_after_; }
  bool is_periodic() const { return memory_.hold > 0 && time() - memory_.changed <= 1.5 * memory_.hold; }
  bool limited_by_stability(double radius, double of_hold) const;
  void use(Choice choice);
  void note_change();
  void consider_inputs(double end, bool changed);
  void leave_multistep();
  bool replace_failed(unsigned& failed);
  void consider(double end, double span);
  // What is expected until the inputs change.
  struct Outlook {
    double span;   // s, of the communication step
    double steps;  // of the one-step method
    double hold;   // s, between two changes
  };
  bool consider_one_step(const Outlook& outlook);
  bool consider_multistep(const Outlook& outlook);
  bool adams_pays(const Outlook& outlook) const;
  void consider_stiffness(const Outlook& outlook);
  Choice instead_of_explicit(double radius, const Outlook& outlook) const;
  Choice instead_of_other(double radius, const Outlook& outlook);
  double expected_hold(double end) const { return std::max(memory_.hold, end - memory_.changed); }
  bool exponential_pays(double radius, const Outlook& outlook);
  bool vibrates_freely(double radius);
  double present_cost(double span) const;
  void begin_trial(Choice candidate, double span);
  bool is_hopeless(double spent, double passed) const;
  void follow_trial(bool within_hold);
  void judge_trial(double cost);
  double work() const;
  double cost() const;
  // Right-hand sides after which the step size is that of the method, not of its start.
  double settled_work() const {
    return slope_time() * (is_multistep(choice()) ? Tuning::settled_multistep : Tuning::settled);
  }
  double step_work(Choice choice) const {
    return slope_time(choice) * (is_implicit(choice) ? Tuning::dirk_step : Tuning::explicit_stages);
  }
  double slope_time(Choice choice) const { return slope_times_[static_cast<std::size_t>(choice)]; }
  double slope_time() const { return slope_time(choice()); }
  double trial_work() const { return slope_time() * Tuning::trial_cost; }
  Statistics of_method_in_use() const;
  void begin_account();
  void end_measurement();
  void count();

  System& system_;
  SolverSettings settings_;
  Scratch scratch_;
  SpectralRadius radius_;
  std::array<double, choices> slope_times_;
  // As Choice numbers them, created at initialization, so that no step allocates. The matrices of implicit
  // methods grow with the square of the size: those of large systems are created when they are first tried,
  // and so is the exponential method, which takes most and is rarely needed.
  std::array<std::unique_ptr<Integrator>, choices> methods_;
  long pause_ = Tuning::steps_between_choices;  // internal steps
  Integrator* current_ = &integrator(first_choice);
  AutomaticMemory memory_;
  Statistics before_;      // of the methods used before the one in use
  Statistics statistics_;  // all
  Decision decision_;      // the last
  long decisions_ = 0;
};

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

double Automatic::work() const {
  return static_cast<double>(statistics_.evaluations) +
         Tuning::jacobian_column * (system_.nq() + system_.nv() + system_.layout().actuators()) *
             static_cast<double>(statistics_.jacobians) +
         statistics_.other_work;
}

void Automatic::begin_account() {
  memory_.mark_work = memory_.older_work = work();
  memory_.mark_time = memory_.older_time = time();
}

// Right-hand sides per second of the method in use, over its last two measurements.
double Automatic::cost() const { return (work() - memory_.older_work) / (time() - memory_.older_time); }

// Ends a measurement. If the method in use now costs more than its rival did in the last trial, the motion
// has become more difficult, and the trial has decided nothing.
void Automatic::end_measurement() {
  const double spent = work() - memory_.mark_work, passed = time() - memory_.mark_time;
  if (spent < Tuning::bucket * slope_time()) return;
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

Statistics Automatic::of_method_in_use() const {
  Statistics all = current_->statistics();
  all.other_work += (slope_time() - 1) * static_cast<double>(all.evaluations);
  return all;
}

void Automatic::count() {
  statistics_ = of_method_in_use();
  statistics_.add(before_);
}

// What the tolerance allows, or the last step.
double Automatic::step() const {
  return controls_step(choice()) ? static_cast<const OneStep*>(current_)->allowed_step()
                                 : current_->statistics().step_size;
}

// For how many steps of the one-step method the inputs are expected to be held: as long as before, or as long
// as they are held already.
double Automatic::steps_held(double end, double span) const {
  const double expected = expected_hold(end);
  double own = step();
  if (is_multistep(choice())) {
    own = memory_.step[static_cast<int>(one_step_like(choice()))];
    if (own == 0) own = memory_.step[static_cast<int>(first_choice)];
  }
  if (!(own > 0)) return expected / span;
  return expected / (passes_ends() ? own : std::min(own, span));
}

// Whether stability limits the steps of the explicit method in use.
bool Automatic::limited_by_stability(double radius, double of_hold) const {
  return choice() == Choice::adams
             ? step() * radius > (has_series ? Tuning::series_stability : Tuning::adams_stability)
             : static_cast<const OneStep*>(current_)->stability_used(radius) >
                   (of_hold >= Tuning::long_hold ? Tuning::erk_stability_held : Tuning::erk_stability);
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

void Automatic::consider_inputs(double end, bool changed) {
  const double span = end - time();
  if (changed) note_change();
  // a multistep method does not pay for its restarts
  if (is_multistep(choice()) && steps_held(end, span) < Tuning::held_for_restart) leave_multistep();
  if (changed || !is_periodic()) consider(end, span);
}

Outcome Automatic::advance(double end, bool inputs_changed) {
  const bool is_interpolation = !inputs_changed && !is_trial() && current_->reaches(end);
  if (is_interpolation || !is_later(end, time())) return current_->advance(end, inputs_changed);
  const double span = end - time();
  consider_inputs(end, inputs_changed);
  StepBudget budget(time(), end);
  const long before = statistics_.steps;
  unsigned failed = 0;  // methods, at `failed_at`
  double failed_at = time();
  while (time() < end) {
    Outcome outcome = current_->advance(end, inputs_changed);
    count();
    if (!outcome.ok) {
      if (time() > failed_at) failed = 0;
      failed_at = time();
      if (!replace_failed(failed)) return outcome;
      continue;
    }
    inputs_changed = false;
    const long taken = statistics_.steps - before;
    if (budget.is_hopeless(taken, time(), end)) return failure(time(), budget.hopeless(name()));
    if (taken > budget.steps())
      return failure(time(), budget.exceeded(system_, name(), settings_, time(), state()));
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

void Automatic::consider(double end, double span) {
  if (!(time() > memory_.mark_time)) return;
  // costs are those of whole intervals between changes of the inputs
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
  // one step of an explicit method for each input cannot be undercut
  const bool is_settled = work() - memory_.begun >= settled_work();
  if (is_settled && work() >= memory_.estimate_due && outlook.steps >= Tuning::held_for_estimate)
    consider_stiffness(outlook);
}

// The one-step method of the same kind.
bool Automatic::consider_one_step(const Outlook& outlook) {
  const Choice other = one_step_like(choice());
  const double used = work() - memory_.begun, known = memory_.step[static_cast<int>(other)];
  if (used < settled_work() || !may_try(other)) return false;
  if (!is_periodic()) {
    if (memory_.steady == 0 || known == 0) return false;
    // what it would cost, as far as its step size is not out of date
    if (used < Tuning::outdated && step_work(other) / std::min(known, outlook.span) > cost()) return false;
  }
  begin_trial(other, outlook.span);
  return true;
}

// The multistep method of the same kind.
bool Automatic::consider_multistep(const Outlook& outlook) {
  const Choice other = multistep_like(choice());
  if (outlook.steps < (is_implicit(choice()) ? Tuning::held_for_bdf : Tuning::held_for_adams)) return false;
  if (other == choice() || !may_try(other)) return false;
  if (work() - memory_.older_work < Tuning::least_account) return false;
  if (other == Choice::adams && !adams_pays(outlook)) return false;
  begin_trial(other, outlook.span);
  return true;
}

bool Automatic::adams_pays(const Outlook& outlook) const {
  // in long communication steps the gain is small
  const double used = work() - memory_.begun;
  if (outlook.span > Tuning::longest_for_adams * step() && used < Tuning::long_trial_after) return false;
  return present_cost(outlook.span) * outlook.hold >=
         slope_time(Choice::adams) * (Tuning::adams_restart + Tuning::adams_step * outlook.hold / step());
}

void Automatic::consider_stiffness(const Outlook& outlook) {
  before_.evaluations += SpectralRadius::evaluations;
  const double radius = radius_.estimate(system_, time(), state());
  count();
  memory_.interval = std::min(2 * memory_.interval, Tuning::rarest_estimate);
  memory_.estimate_due = work() + memory_.interval;
  if (!(time() > memory_.older_time)) return;
  const bool steps_by_stability = choice() == Choice::erk || choice() == Choice::adams;
  Choice candidate =
      steps_by_stability ? instead_of_explicit(radius, outlook) : instead_of_other(radius, outlook);
  if (exponential_pays(radius, outlook)) candidate = Choice::exponential;
  if (candidate != choice()) begin_trial(candidate, outlook.span);
}

Choice Automatic::instead_of_explicit(double radius, const Outlook& outlook) const {
  const double of_hold = cost() * outlook.hold;
  if (!limited_by_stability(radius, of_hold)) return choice();
  if (outlook.steps >= Tuning::held_for_bdf && of_hold > slope_time(Choice::bdf) * Tuning::bdf_restart &&
      may_try(Choice::bdf))
    return Choice::bdf;
  return of_hold > step_work(Choice::dirk) && may_try(Choice::dirk) ? Choice::dirk : choice();
}

Choice Automatic::instead_of_other(double radius, const Outlook& outlook) {
  // cost of explicit steps, limited by stability and communication steps
  const double rate = is_multistep(choice()) ? 0.0 : 1 / outlook.span;
  // at its stability limit adams takes more than erk
  const bool adams_is_stable = step() * radius < Tuning::adams_stability;
  const Choice other =
      is_multistep(choice()) && adams_is_stable && may_try(Choice::adams) ? Choice::adams : first_choice;
  const double explicit_cost = step_work(other) * std::max(radius / Tuning::explicit_step, rate);
  if (explicit_cost < Tuning::promised_gain * cost() && may_try(other)) return other;
  // bdf whose steps are bound to the spectral radius
  const double before = memory_.oscillation, now = step() * radius;
  memory_.oscillation = now;
  const bool bound =
      now < Tuning::bdf_oscillatory && now < Tuning::steady * before && before < Tuning::steady * now;
  return choice() == Choice::bdf && bound && may_try(Choice::dirk) ? Choice::dirk : choice();
}

// Whether vibrations that are much faster than the communication steps, and undamped, bind the steps of the
// other methods.
bool Automatic::exponential_pays(double radius, const Outlook& outlook) {
  // a contact separates before it has vibrated
  if (choice() == Choice::exponential || !may_try(Choice::exponential) || system_.plan().has_contacts())
    return false;
  if (radius * outlook.span < Tuning::fast_vibration || step() * radius > Tuning::bound_by_vibration)
    return false;
  const double a_step = Tuning::exponential_slopes + Tuning::jacobian_column * system_.size() +
                        PhiFunctions::cost(system_.size(), outlook.span * radius);
  return a_step / outlook.span < Tuning::promised_gain * cost() && vibrates_freely(radius);
}

// The sum of all eigenvalues is the rate at which damping reduces the volume of phase space. By differences,
// which take no memory.
bool Automatic::vibrates_freely(double radius) {
  const int size = system_.layout().work.begin;
  double *const moved = sundials::data(scratch_->vectors[0]), *const slope =
                                                                  sundials::data(scratch_->vectors[1]);
  std::copy_n(state(), system_.size(), moved);
  system_.nominals(scratch_->start.data());
  before_.evaluations += 2 * size;
  count();
  double trace = 0;
  for (int i = 0; i < size; ++i) {
    const double step = Tuning::difference_step * scratch_->start[i];
    for (const double sign : {1.0, -1.0}) {
      moved[i] = state()[i] + sign * step;
      if (system_.slope_within_step(time(), moved, slope) != Status::ok) return false;
      trace += sign * slope[i] / (2 * step);
    }
    moved[i] = state()[i];
  }
  return std::fabs(trace) < Tuning::undamped * radius;
}

// At most that of the present step, without those of a start.
double Automatic::present_cost(double span) const {
  if (!controls_step(choice()) || choice() == Choice::exponential || is_periodic()) return cost();
  return std::min(cost(), Tuning::present_margin * step_work(choice()) / std::min(step(), span));
}

void Automatic::begin_trial(Choice candidate, double span) {
  const std::uint8_t home = memory_.choice;
  double home_cost = present_cost(span);
  // a short part that is difficult for the method in use, for example an impact, decides nothing
  if (memory_.average_work > 0) home_cost = std::min(home_cost, memory_.average_work / memory_.average_time);
  note(Event::tries, candidate, choice(), 0, home_cost);
  use(candidate);
  memory_.home = home;
  memory_.home_cost = home_cost;
  memory_.extensions = 0;
  // after a change of the inputs each interval has a start
  memory_.measuring = is_periodic() && time() == memory_.changed && home_cost * memory_.hold > trial_work();
  begin_account();
}

// Whether a measurement need not wait for the end of an interval between changes: the method before would
// have cost less until then, or in the part that has passed.
bool Automatic::is_hopeless(double spent, double passed) const {
  const double rest = memory_.changed + memory_.hold - time();
  if (rest > 0 && spent > Tuning::lost * memory_.home_cost * (passed + rest)) return true;
  return memory_.mark_time > memory_.changed && spent >= slope_time() * Tuning::settled_multistep &&
         spent > Tuning::hopeless * memory_.home_cost * passed;
}

void Automatic::follow_trial(bool within_hold) {
  const double spent = work() - memory_.mark_work, passed = time() - memory_.mark_time;
  if (within_hold) {
    if (is_hopeless(spent, passed)) return judge_trial(spent / passed);
    if (spent < Tuning::longest_trial) return;
  }
  if (memory_.measuring == 0) {
    if (spent < slope_time() * (choice() == Choice::erk ? Tuning::settling_cost_erk : Tuning::settling_cost))
      return;
    memory_.measuring = 1;
    memory_.mark_step = step();
    begin_account();
    return;
  }
  if (spent < trial_work()) return;
  const double cost = spent / passed;
  // steps that still grow will cost less
  if (cost > memory_.home_cost && step() > Tuning::growing * memory_.mark_step &&
      memory_.extensions < Tuning::most_extensions) {
    ++memory_.extensions;
    memory_.mark_step = step();
    begin_account();
    return;
  }
  judge_trial(cost);
}

void Automatic::judge_trial(double cost) {
  const Choice home = static_cast<Choice>(memory_.home), tried = choice();
  const double ratio = cost / memory_.home_cost;
  const bool better = ratio < Tuning::better;
  const int loser = static_cast<int>(better ? home : tried);
  double& wait = memory_.wait[loser];
  // trials take a small share of the work
  const double excess = std::fabs(cost - memory_.home_cost) * (time() - memory_.mark_time);
  const double scale = std::max(1.0, excess / Tuning::usual_excess);
  if (better) {
    memory_.due[loser] =
        work() + scale * std::min(Tuning::first_wait / (ratio * ratio), Tuning::longest_wait);
  } else {
    memory_.due[loser] = work() + scale * wait;
    wait = std::min(Tuning::longer_wait * wait, Tuning::longest_wait);
  }
  memory_.wait[static_cast<int>(better ? tried : home)] = Tuning::first_wait;
  memory_.rival = static_cast<std::uint8_t>(loser);
  memory_.failed_cost = better ? memory_.home_cost : cost;
  note(better ? Event::keeps : Event::returns, tried, home, cost, memory_.home_cost);
  if (better) {
    memory_.interval = Tuning::first_estimate;
    memory_.estimate_due = std::min(memory_.estimate_due, work() + memory_.interval);
    memory_.home = memory_.choice;
    memory_.average_work = work() - memory_.mark_work;
    memory_.average_time = time() - memory_.mark_time;
  } else {
    use(home);
  }
  begin_account();
}

void Automatic::save(std::vector<unsigned char>& bytes) const {
  ByteWriter writer(bytes);
  put(writer, state_header(system_, settings_, SolverMethod::automatic));
  AutomaticMemory::each_part(memory_, [&writer](const auto& part) { writer.put(part); });
  put(writer, before_);
  current_->save(bytes);
}

bool Automatic::restore(const unsigned char* bytes, std::size_t size) {
  ByteReader reader(bytes, size);
  if (!matches(reader, state_header(system_, settings_, SolverMethod::automatic))) return false;
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

}  // namespace

std::unique_ptr<Integrator> make_automatic(System& system, const SolverSettings& settings, Scratch scratch) {
  return std::make_unique<Automatic>(system, settings, std::move(scratch));
}

}  // namespace redysim
