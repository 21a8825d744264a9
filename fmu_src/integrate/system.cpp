#include "integrate/system.hpp"

#include <cmath>

#include "dynamics/bias.hpp"
#include "dynamics/compiled.hpp"
#include "dynamics/energy.hpp"
#include "dynamics/loop_correction.hpp"

namespace redysim {

namespace {

constexpr double closed_gap = 1e-13;        // m or rad: nothing left to project
constexpr int projection_iterations = 8;

}  // namespace

System::System(const Plan<double>& plan, bool with_work)
    : plan_(plan),
      with_work_(with_work),
      tau_(static_cast<std::size_t>(plan.nv), 0.0),
      workspace_(plan),
      scratch_(static_cast<std::size_t>(plan.nv), 0.0) {}

Status System::accelerations(double, const double* y, double* qdd) {
  ++evaluations_;
  compiled_forward_dynamics(plan_, workspace_, y, y + plan_.nq, tau_.data(), qdd);
  // one sum finds any non-finite entry: inf - inf and nan are nan
  double sum = 0;
  for (int i = 0; i < plan_.nv; ++i) sum += qdd[i] * 0.0;
  if (sum == 0) return Status::ok;
  failed_joint_ = 0;
  while (failed_joint_ + 1 < plan_.nv && std::isfinite(qdd[failed_joint_])) ++failed_joint_;
  return Status::recoverable;
}

Status System::right_hand_side(double time, const double* y, double* ydot) {
  const double* qd = y + plan_.nq;
  const Status status = accelerations(time, y, ydot + plan_.nq);
  for (int i = 0; i < plan_.nv; ++i) ydot[i] = qd[i];
  if (with_work_) ydot[plan_.nq + plan_.nv] = external_power(plan_, workspace_, qd, tau_.data());
  return status;
}

double System::set_residuals(const double* q, const double* qd) {
  set_positions(plan_, workspace_, q);
  set_velocities(plan_, workspace_, qd);
  set_ground_motion(plan_, workspace_, qd);
  set_loop_residuals(plan_, workspace_);
  double largest = 0;
  for (double phi : workspace_.loop.residual) largest = std::max(largest, std::abs(phi));
  return largest;
}

Status System::project(double time, double* y, double* error) {
  if (plan_.loops.empty()) return Status::ok;
  double* q = y;
  double* qd = y + plan_.nq;
  LoopState<double>& loop = workspace_.loop;
  // the elimination at the arriving point serves every correction: they are small
  if (accelerations(time, y, scratch_.data()) != Status::ok) return Status::recoverable;
  double gap = 0;
  for (double phi : loop.residual) gap = std::max(gap, std::abs(phi));
  for (int k = 0; gap > closed_gap && k < projection_iterations; ++k) {
    for (std::size_t row = 0; row < loop.b.size(); ++row) loop.b[row] = -loop.residual[row];
    correct_loops(plan_, workspace_, scratch_.data());
    for (int i = 0; i < plan_.nv; ++i) q[i] += scratch_[i];
    const double before = gap;
    gap = set_residuals(q, qd);
    if (!(gap < before)) break;
  }
  if (!std::isfinite(gap)) return Status::recoverable;
  for (int k = 0; k < projection_iterations; ++k) {
    set_residuals(q, qd);
    double largest = 0;
    for (double rate : loop.rate) largest = std::max(largest, std::abs(rate));
    if (!(largest > closed_gap)) break;
    for (std::size_t row = 0; row < loop.b.size(); ++row) loop.b[row] = -loop.rate[row];
    correct_loops(plan_, workspace_, scratch_.data());
    for (int i = 0; i < plan_.nv; ++i) qd[i] += scratch_[i];
  }
  if (error != nullptr) project_error(error);
  return Status::ok;
}

// The error estimate loses what the projection takes away: its part across the constraints.
void System::project_error(double* error) {
  for (double* part : {error, error + plan_.nq}) {
    set_velocities(plan_, workspace_, part);
    set_ground_motion(plan_, workspace_, part);
    set_loop_residuals(plan_, workspace_);
    for (std::size_t row = 0; row < workspace_.loop.b.size(); ++row)
      workspace_.loop.b[row] = -workspace_.loop.rate[row];
    correct_loops(plan_, workspace_, scratch_.data());
    for (int i = 0; i < plan_.nv; ++i) part[i] += scratch_[i];
  }
}

double System::kinetic_energy(const double* y) {
  return redysim::kinetic_energy(plan_, workspace_, y, y + plan_.nq);
}

double System::potential_energy(const double* y) {
  return redysim::potential_energy(plan_, workspace_, y, y + plan_.nq);
}

}  // namespace redysim
