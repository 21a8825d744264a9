#include "integrate/system.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/bias.hpp"
#include "dynamics/compiled.hpp"
#include "dynamics/energy.hpp"
#include "dynamics/loop_correction.hpp"

namespace redysim {

namespace {

constexpr double rounding = 1e-15;  // of a residual, relative to the loop points' coordinates
constexpr double open_gap = 1e-11;  // m or rad: more than a passing singular position leaves behind
constexpr int projection_iterations = 8;

double largest_of(const double* values, int count) {
  double size = 0;
  for (int i = 0; i < count; ++i) size = std::max(size, std::abs(values[i]));
  return size;
}

double largest(const std::vector<double>& values) {
  return largest_of(values.data(), static_cast<int>(values.size()));
}

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

void System::set_residuals(const double* q, const double* qd) {
  set_positions(plan_, workspace_, q);
  set_velocities(plan_, workspace_, qd);
  set_ground_motion(plan_, workspace_, qd);
  set_loop_residuals(plan_, workspace_);
}

Status System::project(double time, double* y, double* error) {
  if (plan_.loops.empty()) return Status::ok;
  workspace_.loop.rank_tolerance = projection_rank_tolerance;
  Status status = project_within_rank(time, y, error);
  if (status == Status::ok && largest(workspace_.loop.residual) > open_gap) {
    // constraints that are nearly dependent for good, not only in passing
    workspace_.loop.rank_tolerance = dynamics_rank_tolerance;
    status = project_within_rank(time, y, error);
  }
  workspace_.loop.rank_tolerance = dynamics_rank_tolerance;
  return status;
}

Status System::project_within_rank(double time, double* y, double* error) {
  double* q = y;
  double* qd = y + plan_.nq;
  // the elimination at the arriving point serves every correction: they are small
  if (accelerations(time, y, scratch_.data()) != Status::ok) return Status::recoverable;
  set_residuals(q, qd);
  reduce_residual(workspace_.loop.residual, rounding * workspace_.loop.extent, q, q, qd);
  const double speed = largest_of(qd, plan_.nv);
  reduce_residual(workspace_.loop.rate, rounding * workspace_.loop.extent * speed, qd, q, qd);
  if (!std::isfinite(largest(workspace_.loop.residual) + largest(workspace_.loop.rate))) return Status::recoverable;
  if (error != nullptr) project_error(error);
  return Status::ok;
}

// Newton corrections of `part` (q or qd of the state) until `residual` is rounding or grows no smaller.
void System::reduce_residual(const std::vector<double>& residual, double enough, double* part, const double* q,
                             const double* qd) {
  double size = largest(residual);
  for (int k = 0; size > enough && k < projection_iterations; ++k) {
    const double before = size;
    for (std::size_t row = 0; row < residual.size(); ++row) workspace_.loop.b[row] = -residual[row];
    correct_loops(plan_, workspace_, scratch_.data());
    for (int i = 0; i < plan_.nv; ++i) part[i] += scratch_[i];
    set_residuals(q, qd);
    size = largest(residual);
    if (!(size < 0.5 * before)) break;
  }
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
