#include <algorithm>
#include <array>
#include <cmath>

#include "integrate/methods/one_step.hpp"
#include "integrate/methods/state_bytes.hpp"
#include "integrate/methods/step_budget.hpp"
#include "integrate/methods/tuning.hpp"
#include "integrate/system/spectral_radius.hpp"

// Chooses among the four methods during the run (docs/solvers.md, constants in tuning.hpp).
//
// * Multistep or one-step: a multistep method starts after the inputs have been held for some communication
//   steps and ends when they change. An explicit one also needs communication steps that are at most a few of
//   the steps allowed by the tolerance.
// * Explicit or implicit: from time to time the spectral radius is estimated. Where the explicit method
//   is limited by its stability, or an implicit one costs more than explicit steps within the stability limit
//   would, the other is tried. A trial that costs more per second than what it replaced is undone,
//   and the next one waits longer. Where the stability of bdf limits its steps, dirk is tried likewise.

namespace redysim {
namespace {

enum class Choice : std::uint8_t { erk, adams, dirk, bdf };
constexpr int choices = 4;

bool is_implicit(Choice choice) { return choice >= Choice::dirk; }
bool is_multistep(Choice choice) { return choice == Choice::adams || choice == Choice::bdf; }

void add(const Statistics& more, Statistics& sum) {
  sum.steps += more.steps;
  sum.rejected += more.rejected;
  sum.evaluations += more.evaluations;
  sum.jacobians += more.jacobians;
}

class Automatic final : public Integrator {
 public:
  Automatic(System& system, const SolverSettings& settings);

  Outcome start(double time, const double* y) override;
  Outcome advance(double end, bool inputs_changed) override;

  double time() const override { return current_->time(); }
  const double* state() const override { return current_->state(); }
  const Statistics& statistics() const override { return statistics_; }
  const char* name() const override { return current_->name(); }
  SolverMethod method() const override { return current_->method(); }

  void save(std::vector<unsigned char>& bytes) const override;
  bool restore(const unsigned char* bytes, std::size_t size) override;

 private:
  // What the continuation depends on, in addition to the method in use.
  struct Memory {
    std::uint8_t choice = 0;       // a Choice
    std::uint8_t trying = 0;       // during a trial
    std::uint8_t oscillatory = 0;  // dirk in place of bdf
    std::int32_t held = 0;         // communication steps since the inputs changed
    std::int32_t backoff = 1;
    std::int64_t interval = Tuning::first_estimate;  // right-hand sides between two estimates
    double mark_work = 0, mark_time = 0;             // start of the present measurement of cost
    double other_cost = 0;                           // right-hand sides per second before the trial
    double step[choices] = {};                       // s, last of each method, 0: unknown
  };

  // All of Memory, to be saved and restored.
  template <class SomeMemory, class Visit>
  static void each_part(SomeMemory& memory, const Visit& visit) {
    visit(memory.choice);
    visit(memory.trying);
    visit(memory.oscillatory);
    visit(memory.held);
    visit(memory.backoff);
    visit(memory.interval);
    visit(memory.mark_work);
    visit(memory.mark_time);
    visit(memory.other_cost);
    for (auto& step : memory.step) visit(step);
  }

  Choice choice() const { return static_cast<Choice>(memory_.choice); }
  std::array<Integrator*, choices> methods() const {  // as Choice numbers them
    return {erk_.get(), adams_.get(), dirk_.get(), bdf_.get()};
  }
  Integrator& integrator(Choice choice) const { return *methods()[static_cast<std::size_t>(choice)]; }
  double step() const;
  bool limited_by_stability(double radius) const;
  void use(Choice choice);
  void choose_multistep(double span);
  void check_stiffness(double span);
  void judge_trial(double cost);
  double work() const;
  void begin_account();
  void count();

  System& system_;
  SolverSettings settings_;
  SpectralRadius radius_;
  // all are created at initialization, so that no step allocates
  std::unique_ptr<OneStep> erk_, dirk_;
  std::unique_ptr<Integrator> adams_, bdf_;
  Integrator* current_;
  Memory memory_;
  Statistics before_;      // of the methods used before the one in use
  Statistics statistics_;  // all
};

Automatic::Automatic(System& system, const SolverSettings& settings)
    : system_(system),
      settings_(settings),
      radius_(system),
      erk_(make_erk(system, settings)),
      dirk_(make_dirk(system, settings)),
      adams_(make_adams(system, settings)),
      bdf_(make_bdf(system, settings)),
      current_(erk_.get()) {
  for (Integrator* method : methods()) method->pause_after(Tuning::steps_between_choices);
}

Outcome Automatic::start(double time, const double* y) {
  memory_ = {};
  memory_.mark_time = time;
  before_ = statistics_ = {};
  current_ = erk_.get();
  return current_->start(time, y);
}

double Automatic::work() const {
  return static_cast<double>(statistics_.evaluations) +
         Tuning::jacobian_column * (system_.nq() + system_.nv() + system_.layout().actuators()) *
             static_cast<double>(statistics_.jacobians);
}

void Automatic::begin_account() {
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

// Whether stability limits the steps of the explicit method in use.
bool Automatic::limited_by_stability(double radius) const {
  return choice() == Choice::adams ? step() * radius > Tuning::adams_stability
                                   : erk_->stability_used(radius) > (memory_.held >= Tuning::held_for_bdf
                                                                         ? Tuning::erk_stability_held
                                                                         : Tuning::erk_stability);
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
  memory_.choice = static_cast<std::uint8_t>(choice);
  if (!is_implicit(choice)) memory_.oscillatory = 0;
  count();
}

void Automatic::choose_multistep(double span) {
  bool multistep = false;
  if (is_implicit(choice())) {
    const double own = memory_.step[static_cast<int>(Choice::bdf)];
    multistep = memory_.oscillatory == 0 && (memory_.held >= Tuning::held_for_bdf ||
                                             span > Tuning::restart_negligible * (own > 0 ? own : step()));
  } else if (memory_.held >= Tuning::held_for_adams) {
    const double allowed = choice() == Choice::adams ? memory_.step[static_cast<int>(Choice::erk)] : step();
    multistep = span < Tuning::longest_for_adams * allowed;
  }
  if (multistep != is_multistep(choice()))
    use(is_implicit(choice()) ? (multistep ? Choice::bdf : Choice::dirk)
                              : (multistep ? Choice::adams : Choice::erk));
}

Outcome Automatic::advance(double end, bool inputs_changed) {
  if (!is_later(end, time())) return current_->advance(end, inputs_changed);
  const double span = end - time();
  memory_.held = inputs_changed ? 0 : std::min(memory_.held + 1, 1000);
  choose_multistep(span);
  StepBudget budget(time(), end);
  const long before = statistics_.steps;
  bool changed = inputs_changed;
  while (time() < end) {
    const Outcome outcome = current_->advance(end, changed);
    changed = false;
    count();
    if (!outcome.ok) return outcome;
    const long taken = statistics_.steps - before;
    if (budget.is_hopeless(taken, time(), end)) return failure(time(), budget.hopeless(name()));
    if (taken > budget.steps()) return failure(time(), budget.exceeded(system_, name(), time(), state()));
    check_stiffness(span);
  }
  return {};
}

void Automatic::check_stiffness(double span) {
  const double spent = work() - memory_.mark_work, passed = time() - memory_.mark_time;
  if (!(passed > 0)) return;
  const double cost = spent / passed;
  if (memory_.trying != 0) {
    if (spent >= Tuning::trial_cost) judge_trial(cost);
    return;
  }
  if (spent < static_cast<double>(memory_.interval) * memory_.backoff) return;
  memory_.interval = std::min<std::int64_t>(2 * memory_.interval, Tuning::rarest_estimate);
  before_.evaluations += SpectralRadius::evaluations;
  const double radius = radius_.estimate(system_, time(), state());
  bool promising;
  if (is_implicit(choice())) {
    // cost of explicit steps, limited by stability and communication steps
    promising = Tuning::explicit_stages *
                    std::max(radius / Tuning::explicit_step, is_multistep(choice()) ? 0.0 : 1 / span) <
                Tuning::promised_gain * cost;
  } else {
    promising = limited_by_stability(radius);
  }
  count();
  if (promising) {
    memory_.other_cost = cost;
    memory_.trying = 1;
    const bool held = is_multistep(choice()) || memory_.held >= Tuning::held_for_bdf ||
                      span > Tuning::restart_negligible * step();
    use(is_implicit(choice()) ? Choice::erk : (held ? Choice::bdf : Choice::dirk));
  } else if (choice() == Choice::bdf && step() * radius < Tuning::bdf_oscillatory) {
    memory_.other_cost = cost;
    memory_.trying = memory_.oscillatory = 1;
    use(Choice::dirk);
  }
  begin_account();
}

void Automatic::judge_trial(double cost) {
  memory_.trying = 0;
  if (cost > memory_.other_cost) {
    memory_.backoff = std::min(4 * memory_.backoff, Tuning::longest_backoff);
    const bool was_implicit = memory_.oscillatory == 0 && is_implicit(choice());
    memory_.oscillatory = 0;
    use(was_implicit ? Choice::erk : Choice::bdf);
  } else {
    memory_.backoff = 1;
    memory_.interval = Tuning::first_estimate;
  }
  begin_account();
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
  if (!reader.good() || memory.choice >= choices || memory.oscillatory > 1) return false;
  Integrator& next = integrator(static_cast<Choice>(memory.choice));
  if (!next.restore(reader.rest(), reader.left())) return false;
  current_ = &next;
  memory_ = memory;
  before_ = before;
  count();
  return true;
}

}  // namespace

std::unique_ptr<Integrator> make_automatic(System& system, const SolverSettings& settings) {
  return std::make_unique<Automatic>(system, settings);
}

}  // namespace redysim
