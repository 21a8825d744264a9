#include <algorithm>
#include <cmath>

#include "integrate/methods/automatic/automatic.hpp"

// Accounts for the work of the methods.

namespace redysim {

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

// Right-hand sides per second of simulated time of the method in use, over its last two measurements.
double Automatic::cost() const { return (work() - memory_.older_work) / (time() - memory_.older_time); }

// Ends a measurement. If the method in use now costs more than its rival did in the last trial, the motion
// has become more difficult, and the result of that trial is invalid.
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

// Step size, s: that allowed by the tolerance, or the last one.
double Automatic::step() const {
  return controls_step(choice()) ? static_cast<const OneStep*>(current_)->allowed_step()
                                 : current_->statistics().step_size;
}

// cost() without the cost of a start: limited by that of the present step size.
double Automatic::present_cost(double span) const {
  if (!controls_step(choice()) || choice() == Choice::exponential || is_periodic()) return cost();
  return std::min(cost(), Tuning::present_margin * step_work(choice()) / std::min(step(), span));
}

}  // namespace redysim
