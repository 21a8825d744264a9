#include <algorithm>
#include <cmath>

#include "integrate/methods/automatic/automatic.hpp"
#include "integrate/methods/force_corners.hpp"
#include "integrate/methods/phi_functions.hpp"

// Selects a method that promises to be cheaper than the one in use.

namespace redysim {

// Number of steps of the one-step method for which the inputs are expected to be held: as long as before, or
// as long as they have been held already.
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
  // a limit is confirmed by a second estimate at half the threshold
  if (memory_.limited != 0) radius *= 2;
  return choice() == Choice::adams
             ? step() * radius > (has_series ? Tuning::series_stability : Tuning::adams_stability)
             : static_cast<const OneStep*>(current_)->stability_used(radius) >
                   (of_hold >= Tuning::long_hold ? Tuning::erk_stability_held : Tuning::erk_stability);
}

// Whether many steps of the method in use fail, for example because Newton's iteration diverges.
bool Automatic::is_struggling() const {
  const Statistics& own = current_->statistics();
  return own.steps < Tuning::few_accepted * own.rejected;
}

// Tries the one-step method of the same kind.
bool Automatic::consider_one_step(const Outlook& outlook) {
  const Choice other = one_step_like(choice());
  const double used = work() - memory_.begun, known = memory_.step[static_cast<int>(other)];
  if (used < settled_work() || !may_try(other)) return false;
  if (!is_periodic()) {
    if (known > 0 ? memory_.steady == 0 : !is_struggling()) return false;
    // cost at its last step size, unless this is outdated or unknown
    if (known > 0 && used < Tuning::outdated && step_work(other) / std::min(known, outlook.span) > cost())
      return false;
  }
  begin_trial(other, outlook.span);
  return true;
}

// Tries the multistep method of the same kind.
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
  if ((corners_of(system_) & Corners::of_state) != 0)
    return false;  // at corners it loses more than it gains between them
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
  Choice candidate = steps_by_stability ? confirmed(instead_of_explicit(radius, outlook))
                                        : instead_of_other(radius, outlook);
  if (exponential_pays(radius, outlook)) candidate = Choice::exponential;
  if (candidate != choice()) begin_trial(candidate, outlook.span);
}

// One estimate may be that of a short difficulty, for example a singular configuration of a loop.
Choice Automatic::confirmed(Choice candidate) {
  const bool is_confirmed = memory_.limited != 0;
  memory_.limited = candidate != choice();
  // at corners of forces difficulties are short and recur
  const bool recurs = choice() == Choice::erk && corners_of(system_) != 0;
  if (candidate == choice() || is_confirmed || recurs) return candidate;
  memory_.estimate_due = work() + Tuning::second_estimate;
  return choice();
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
  // cost of explicit steps, limited by stability and by the communication step size
  const double rate = is_multistep(choice()) ? 0.0 : 1 / outlook.span;
  // at its stability limit adams costs more than erk
  const bool adams_is_stable = step() * radius < Tuning::adams_stability;
  const Choice other =
      is_multistep(choice()) && adams_is_stable && may_try(Choice::adams) ? Choice::adams : first_choice;
  const double explicit_cost = step_work(other) * std::max(radius / Tuning::explicit_step, rate);
  if (explicit_cost < Tuning::promised_gain * cost() && may_try(other)) return other;
  // the spectral radius limits the steps of bdf
  const double before = memory_.oscillation, now = step() * radius;
  memory_.oscillation = now;
  const bool bound =
      now < Tuning::bdf_oscillatory && now < Tuning::steady * before && before < Tuning::steady * now;
  return choice() == Choice::bdf && bound && may_try(Choice::dirk) ? Choice::dirk : choice();
}

// Whether undamped vibrations, much faster than the communication steps, limit the steps of the other
// methods.
bool Automatic::exponential_pays(double radius, const Outlook& outlook) {
  // a step over many periods would pass corners within it
  if (choice() == Choice::exponential || !may_try(Choice::exponential) || corners_of(system_) != 0)
    return false;
  if (radius * outlook.span < Tuning::fast_vibration || step() * radius > Tuning::bound_by_vibration)
    return false;
  const double a_step = Tuning::exponential_slopes + Tuning::jacobian_column * system_.size() +
                        PhiFunctions::cost(system_.size(), outlook.span * radius);
  return a_step / outlook.span < Tuning::promised_gain * cost() && vibrates_freely(radius);
}

// Estimates the trace of the Jacobian, the rate at which damping reduces the volume of phase space, by
// differences, which need no matrix.
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

}  // namespace redysim
