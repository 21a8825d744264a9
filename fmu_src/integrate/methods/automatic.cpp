#include <algorithm>
#include <cmath>

#include "integrate/methods/one_step.hpp"
#include "integrate/system/spectral_radius.hpp"
#include "integrate/system/state_bytes.hpp"

// Chooses among the four methods, from what it meets (docs/solvers.md).
//
// * One step or many: a multistep method is begun when the inputs have held still for as long as a beginning
//   costs, and left when they change; an explicit one only where communication steps are no more than a few
//   of the steps that the tolerance allows.
// * Explicit or implicit: from time to time the spectral radius is estimated. Where the explicit method
//   stands at the border of its stability, or an implicit one takes more than explicit steps within that
//   border would, the other is tried; a trial that costs more per second than what it replaced is undone,
//   and the next one waits longer. Where bdf takes steps as short as what rings, dirk is tried likewise.
//
// All counts are of right-hand sides, so that the same run makes the same choices.

namespace redysim {
namespace {

constexpr long pause_steps = 16;      // after which the choice is looked at
constexpr long first_watch = 100;     // right-hand sides until stiffness is looked for,
constexpr long longest_watch = 3000;  // doubled each time
constexpr long trial = 400;           // right-hand sides until a trial is judged
constexpr int longest_backoff = 64;   // of trials that failed
constexpr double border_adams = 0.3;  // step times radius of Adams, whose iteration must contract
constexpr double rings = 10;  // step times radius of bdf below which it is its stability that holds it up
constexpr double near_border = 0.6;  // of its limit, for an explicit one-step method
constexpr double mild_border = 0.2;  // the same where inputs hold still, so that bdf has no beginnings to pay
constexpr double reachable = 2.5;    // step times radius that explicit steps keep to
constexpr double gain = 0.7;         // of the cost: what a trial must promise
constexpr double stages = 7;         // of an explicit step
constexpr double jacobian_work = 1.5;  // right-hand sides for each column, factorization included
constexpr int held_for_adams = 6;      // communication steps, as many as a beginning of Adams costs
constexpr int held_for_bdf = 3;
constexpr double short_step = 6;  // steps that the tolerance allows: adams does with fewer slopes up to here
constexpr double long_step = 30;  // bdf's steps in a communication step: a beginning does not matter

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
  // What the future depends on, beside the method in use.
  struct Memory {
    std::uint8_t choice = 0;  // a Choice
    std::uint8_t trying = 0;  // a trial is under way
    std::uint8_t rung = 0;    // dirk in place of bdf
    std::int32_t held = 0;    // communication steps since the inputs changed
    std::int32_t backoff = 1;
    std::int64_t watch = first_watch;     // right-hand sides between two looks
    double mark_work = 0, mark_time = 0;  // where the present account of cost began
    double other_cost = 0;                // right-hand sides a second, of what a trial replaced
    double step[choices] = {};            // s, last of each method, 0: unknown
  };

  // All of it, to be saved and restored.
  template <class SomeMemory, class Visit>
  static void each_part(SomeMemory& memory, const Visit& visit) {
    visit(memory.choice);
    visit(memory.trying);
    visit(memory.rung);
    visit(memory.held);
    visit(memory.backoff);
    visit(memory.watch);
    visit(memory.mark_work);
    visit(memory.mark_time);
    visit(memory.other_cost);
    for (auto& step : memory.step) visit(step);
  }

  Choice choice() const { return static_cast<Choice>(memory_.choice); }
  Integrator& integrator(Choice choice);
  double step() const;
  bool at_border(double radius) const;
  void use(Choice choice);
  void choose_history(double span);
  void watch(double span);
  void judge(double cost);
  double work() const;
  void begin_account();
  void count();

  System& system_;
  SolverSettings settings_;
  SpectralRadius radius_;
  // all made at once: a change of method in a step must not allocate
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
  for (Integrator* method : {static_cast<Integrator*>(erk_.get()), static_cast<Integrator*>(dirk_.get()),
                             adams_.get(), bdf_.get()})
    method->pause_after(pause_steps);
}

Integrator& Automatic::integrator(Choice choice) {
  switch (choice) {
    case Choice::erk:
      return *erk_;
    case Choice::adams:
      return *adams_;
    case Choice::dirk:
      return *dirk_;
    case Choice::bdf:
      break;
  }
  return *bdf_;
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
         jacobian_work * (system_.nq() + system_.nv()) * static_cast<double>(statistics_.jacobians);
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

// Whether an explicit method's steps are held up by its stability.
bool Automatic::at_border(double radius) const {
  return choice() == Choice::adams
             ? step() * radius > border_adams
             : erk_->stability_used(radius) > (memory_.held >= held_for_bdf ? mild_border : near_border);
}

// Goes on from here with another method: no jump, the same state.
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
  if (!is_implicit(choice)) memory_.rung = 0;
  count();
}

void Automatic::choose_history(double span) {
  bool multistep = false;
  if (is_implicit(choice())) {
    const double own = memory_.step[static_cast<int>(Choice::bdf)];
    multistep =
        memory_.rung == 0 && (memory_.held >= held_for_bdf || span > long_step * (own > 0 ? own : step()));
  } else if (memory_.held >= held_for_adams) {
    const double allowed = choice() == Choice::adams ? memory_.step[static_cast<int>(Choice::erk)] : step();
    multistep = span < short_step * allowed;
  }
  if (multistep != is_multistep(choice()))
    use(is_implicit(choice()) ? (multistep ? Choice::bdf : Choice::dirk)
                              : (multistep ? Choice::adams : Choice::erk));
}

Outcome Automatic::advance(double end, bool inputs_changed) {
  if (!(end > time()) || !std::isfinite(end)) return current_->advance(end, inputs_changed);
  const double span = end - time();
  memory_.held = inputs_changed ? 0 : std::min(memory_.held + 1, 1000);
  choose_history(span);
  const long allowed = allowed_steps(span), before = statistics_.steps;
  bool changed = inputs_changed;
  Pace pace(time());
  while (time() < end) {
    const Outcome outcome = current_->advance(end, changed);
    changed = false;
    count();
    if (!outcome.ok) return outcome;
    if (pace.is_hopeless(statistics_.steps - before, allowed, time(), end))
      return failure(time(), Pace::sentence(allowed, name()));
    if (statistics_.steps - before > allowed)
      return failure(time(), std::to_string(allowed) + " steps did not reach the end of the step");
    watch(span);
  }
  return {};
}

void Automatic::watch(double span) {
  const double spent = work() - memory_.mark_work, passed = time() - memory_.mark_time;
  if (!(passed > 0)) return;
  const double cost = spent / passed;
  if (memory_.trying != 0) {
    if (spent >= trial) judge(cost);
    return;
  }
  if (spent < static_cast<double>(memory_.watch) * memory_.backoff) return;
  memory_.watch = std::min<std::int64_t>(2 * memory_.watch, longest_watch);
  before_.evaluations += SpectralRadius::evaluations;
  const double radius = radius_.estimate(system_, time(), state());
  bool promising;
  if (is_implicit(choice())) {
    // explicit steps, as long as stability and the communication steps let them be
    promising = stages * std::max(radius / reachable, is_multistep(choice()) ? 0.0 : 1 / span) < gain * cost;
  } else {
    promising = at_border(radius);
  }
  count();
  if (promising) {
    memory_.other_cost = cost;
    memory_.trying = 1;
    const bool held = is_multistep(choice()) || memory_.held >= held_for_bdf || span > long_step * step();
    use(is_implicit(choice()) ? Choice::erk : (held ? Choice::bdf : Choice::dirk));
  } else if (choice() == Choice::bdf && step() * radius < rings) {
    memory_.other_cost = cost;
    memory_.trying = memory_.rung = 1;
    use(Choice::dirk);
  }
  begin_account();
}

void Automatic::judge(double cost) {
  memory_.trying = 0;
  if (cost > memory_.other_cost) {
    memory_.backoff = std::min(4 * memory_.backoff, longest_backoff);
    const bool was_implicit = memory_.rung == 0 && is_implicit(choice());
    memory_.rung = 0;
    use(was_implicit ? Choice::erk : Choice::bdf);
  } else {
    memory_.backoff = 1;
    memory_.watch = first_watch;
  }
  begin_account();
}

void Automatic::save(std::vector<unsigned char>& bytes) const {
  std::vector<unsigned char> inner;
  current_->save(inner);
  StateWriter writer(bytes);
  put(writer, state_header(system_, settings_, SolverMethod::automatic));
  each_part(memory_, [&writer](const auto& part) { writer.put(part); });
  put(writer, before_);
  writer.put(inner.data(), inner.size());
}

bool Automatic::restore(const unsigned char* bytes, std::size_t size) {
  StateReader reader(bytes, size);
  if (!matches(reader, state_header(system_, settings_, SolverMethod::automatic))) return false;
  Memory memory;
  Statistics before;
  each_part(memory, [&reader](auto& part) { reader.get(part); });
  get(reader, before);
  if (!reader.good() || memory.choice >= choices || memory.rung > 1) return false;
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
