#include <cmath>

#include "integrate/methods/automatic.hpp"
#include "integrate/methods/one_step.hpp"

// When `auto` tries another method, and which of the two stays.

namespace redysim {

void Automatic::note_step() {
  if (step() == memory_.same_step) return;
  memory_.same_step = step();
  memory_.same_since = work();
}

void Automatic::consider(double end, double span) {
  if (!(time() > memory_.mark_time)) return;
  note_step();
  // costs are those of whole intervals between changes of the inputs
  const bool within_hold = is_periodic() && time() != memory_.changed;
  if (is_trial()) return follow_trial(within_hold);
  if (within_hold && (is_implicit(choice()) || work() - memory_.mark_work < Tuning::long_account ||
                      work() - memory_.interval_begun < Tuning::long_interval * memory_.interval_work))
    return;
  end_measurement();
  const Outlook outlook = {span, steps_held(end, span), expected_hold(end)};
  if (!within_hold && (is_multistep(choice()) ? consider_one_step(outlook) : consider_multistep(outlook)))
    return;
  if (is_estimate_due(outlook)) consider_stiffness(outlook);
}

bool Automatic::is_estimate_due(const Outlook& outlook) const {
  // one step of an explicit method for each input cannot be undercut
  const double start = choice() == Choice::bdf ? Tuning::settled_multistep : Tuning::settled;
  if (work() - memory_.begun < start || outlook.steps < Tuning::held_for_estimate) return false;
  // also where the step has grown to the stability limit of the last estimate
  return work() >= memory_.estimate_due ||
         (!is_implicit(choice()) && instead_of_explicit(memory_.radius, outlook) != choice());
}

// The one-step method of the same kind.
bool Automatic::consider_one_step(const Outlook& outlook) {
  const Choice other = one_step_like(choice());
  const double used = work() - memory_.begun, known = memory_.step[static_cast<int>(other)];
  if (used < settled_work() || !may_try(other)) return false;
  if (!is_periodic()) {
    if (memory_.steady == 0) return false;
    // what it would cost, as far as its step size is known and not out of date
    const bool is_dearer = known > 0 ? stages(other) / std::min(known, outlook.span) > cost() : !is_stuck();
    if (used < Tuning::outdated && is_dearer) return false;
  }
  begin_trial(other, outlook.span);
  return true;
}

// The multistep method of the same kind.
bool Automatic::consider_multistep(const Outlook& outlook) {
  const Choice other = multistep_like(choice());
  if (outlook.steps < (is_implicit(choice()) ? Tuning::held_for_bdf : Tuning::held_for_adams)) return false;
  const double used = work() - memory_.begun;
  // one step for each communication step: much to gain
  const bool at_floor = step() >= outlook.span && used >= Tuning::wait_at_floor &&
                        memory_.wait[static_cast<int>(other)] <= Tuning::first_wait;
  if (!may_try(other) && !at_floor) return false;
  if (work() - memory_.older_work < Tuning::least_account) return false;
  if (other == Choice::adams && !adams_pays(outlook, used)) return false;
  begin_trial(other, outlook.span);
  return true;
}

bool Automatic::adams_pays(const Outlook& outlook, double used) const {
  // in long communication steps the gain is small
  if (outlook.span > Tuning::longest_for_adams * step() && used < Tuning::long_trial_after) return false;
  return cost() * outlook.hold >= Tuning::adams_restart + Tuning::adams_step * outlook.hold / step();
}

double Automatic::estimate_radius() {
  before_.evaluations += SpectralRadius::evaluations;
  memory_.radius = radius_.estimate(system_, time(), state());
  count();
  return memory_.radius;
}

void Automatic::consider_stiffness(const Outlook& outlook) {
  const double radius = estimate_radius();
  memory_.interval = std::min(2 * memory_.interval, Tuning::rarest_estimate);
  memory_.estimate_due = work() + memory_.interval;
  if (!(time() > memory_.older_time)) return;
  const Choice candidate =
      is_implicit(choice()) ? instead_of_implicit(radius, outlook) : instead_of_explicit(radius, outlook);
  if (candidate != choice()) begin_trial(candidate, outlook.span);
}

Automatic::Choice Automatic::instead_of_explicit(double radius, const Outlook& outlook) const {
  const double of_hold = cost() * outlook.hold;
  if (!limited_by_stability(radius, of_hold)) return choice();
  // a trial must not cost much more than the run so far
  if (work() - memory_.begun < Tuning::jacobians_of_trial * jacobian_work()) return choice();
  const bool bdf_pays = memory_.hold == 0 ||  // no change is known
                        (outlook.steps >= Tuning::held_for_bdf && of_hold > Tuning::bdf_restart);
  const Choice other = bdf_pays ? Choice::bdf : Choice::dirk;
  return of_hold > Tuning::dirk_step && may_try(other) ? other : choice();
}

Automatic::Choice Automatic::instead_of_implicit(double radius, const Outlook& outlook) {
  // cost of explicit steps, limited by stability and communication steps
  const double rate = is_multistep(choice()) ? 0.0 : 1 / outlook.span;
  const double explicit_cost = std::max(this->explicit_cost(radius), Tuning::explicit_stages * rate);
  const Choice other = is_multistep(choice()) ? Choice::adams : Choice::erk;
  if (explicit_cost < Tuning::promised_gain * cost() && may_try(other)) return other;
  // bdf whose steps are bound to the spectral radius
  const double before = memory_.oscillation, now = step() * radius;
  memory_.oscillation = now;
  const bool bound =
      now < Tuning::bdf_oscillatory && now < Tuning::steady * before && before < Tuning::steady * now;
  return choice() == Choice::bdf && bound && may_try(Choice::dirk) ? Choice::dirk : choice();
}

void Automatic::begin_trial(Choice candidate, double span) {
  const std::uint8_t home = memory_.choice;
  double home_cost = cost();
  // the present step, without those of a start
  if (!is_multistep(choice()) && !is_periodic())
    home_cost = std::min(home_cost, Tuning::present_margin * stages(choice()) / std::min(step(), span));
  // a short part that is difficult for the method in use, for example an impact, decides nothing
  if (memory_.average_work > 0) home_cost = std::min(home_cost, memory_.average_work / memory_.average_time);
  note(Event::tried, candidate, choice(), 0, home_cost);
  use(candidate);
  memory_.home = home;
  memory_.home_cost = home_cost;
  memory_.extensions = 0;
  // after a change of the inputs each interval has a start
  memory_.measuring =
      is_periodic() && time() == memory_.changed && home_cost * memory_.hold > Tuning::trial_cost;
  begin_account();
}

// Whether a measurement need not wait for the end of an interval between changes: the method before would
// have cost less until then, or in the part that has passed.
bool Automatic::is_hopeless(double spent, double passed) const {
  const double rest = memory_.changed + memory_.hold - time();
  if (rest > 0 && spent > Tuning::lost * home_cost() * (passed + rest)) return true;
  return memory_.mark_time > memory_.changed && spent >= Tuning::settled_multistep &&
         spent > Tuning::hopeless * home_cost() * passed;
}

// Right-hand sides per second of the method before the trial: measured before it or, if more, those that
// stability demands of an explicit method since.
double Automatic::home_cost() const {
  return std::max(memory_.home_cost, memory_.explicit_work / (time() - memory_.mark_time));
}

// The motion of a trial may be stiffer than that before it, for example since a contact began.
void Automatic::watch_stiffness() {
  if (!is_implicit(choice()) || is_implicit(static_cast<Choice>(memory_.home)) ||
      work() - memory_.sampled_work < Tuning::sample_work)
    return;
  const double radius = std::sqrt(memory_.radius * estimate_radius());
  memory_.explicit_work += explicit_cost(radius) * (time() - memory_.sampled);
  memory_.sampled = time();
  memory_.sampled_work = work();
}

void Automatic::follow_trial(bool within_hold) {
  watch_stiffness();
  const double spent = work() - memory_.mark_work, passed = time() - memory_.mark_time;
  if (within_hold) {
    if (is_hopeless(spent, passed)) return judge_trial(spent / passed);
    if (spent < Tuning::longest_trial) return;
  }
  if (memory_.measuring == 0) {
    if (spent < (choice() == Choice::erk ? Tuning::settling_cost_erk : Tuning::settling_cost)) return;
    memory_.measuring = 1;
    memory_.mark_step = step();
    begin_account();
    return;
  }
  if (spent < Tuning::trial_cost) return;
  const double cost = spent / passed;
  // steps that still grow will cost less
  if (cost > Tuning::better * home_cost() && step() > Tuning::growing * memory_.mark_step &&
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
  const double home_cost = this->home_cost(), ratio = cost / home_cost;
  const bool better = ratio < Tuning::better;
  const int loser = static_cast<int>(better ? home : tried);
  double& wait = memory_.wait[loser];
  // trials take a small share of the work
  const double excess = std::fabs(cost - home_cost) * (time() - memory_.mark_time);
  const double scale = std::max(1.0, excess / Tuning::usual_excess);
  if (better) {
    // an explicit method returns only where a spectral radius promises it
    const bool is_promised = is_implicit(tried) && !is_implicit(home);
    const double full = scale * std::min(Tuning::first_wait / (ratio * ratio), Tuning::longest_wait);
    memory_.due[loser] = work() + (is_promised ? Tuning::first_wait : full);
  } else {
    memory_.due[loser] = work() + scale * wait;
    wait = std::min(Tuning::longer_wait * wait, Tuning::longest_wait);
  }
  memory_.wait[static_cast<int>(better ? tried : home)] = Tuning::first_wait;
  memory_.rival = static_cast<std::uint8_t>(loser);
  memory_.failed_cost = better ? home_cost : cost;
  note(better ? Event::stays : Event::returns, tried, home, cost, home_cost);
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

}  // namespace redysim
