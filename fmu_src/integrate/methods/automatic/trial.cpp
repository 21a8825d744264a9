#include <algorithm>
#include <cmath>

#include "integrate/methods/automatic/automatic.hpp"

// Trials of a method.

namespace redysim {

void Automatic::begin_trial(Choice candidate, double span) {
  const std::uint8_t home = memory_.choice;
  double home_cost = present_cost(span);
  // a short interval that is difficult for the method in use, for example an impact, must not decide
  if (memory_.average_work > 0) home_cost = std::min(home_cost, memory_.average_work / memory_.average_time);
  memory_.home_time = memory_.average_time > 0 ? memory_.average_time : time() - memory_.older_time;
  note(Event::tries, candidate, choice(), 0, home_cost);
  use(candidate);
  memory_.home = home;
  memory_.home_cost = home_cost;
  memory_.extensions = 0;
  // while inputs change regularly, each interval includes a start
  memory_.measuring = is_periodic() && time() == memory_.changed && home_cost * memory_.hold > trial_work();
  begin_account();
}

// Whether a trial can end before its interval between input changes: the previous method would have cost less
// until the end of the interval, or in the part that has passed.
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
  // growing steps will cost less
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
  // trials must be a small part of the work
  const double passed = time() - memory_.mark_time;
  const double excess = std::fabs(cost - memory_.home_cost) * passed;
  const double scale = std::max(1.0, excess / Tuning::usual_excess);
  if (better) {
    // a cost measured in a much shorter time was perhaps that of a difficult start
    const bool is_doubtful = memory_.home_time < Tuning::short_evidence * passed;
    memory_.due[loser] =
        work() + (is_doubtful ? Tuning::undecided_wait
                              : scale * std::min(Tuning::first_wait / (ratio * ratio), Tuning::longest_wait));
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

}  // namespace redysim
