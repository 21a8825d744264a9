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
      motion_slot_(static_cast<std::size_t>(plan.nv), -1),
      q_(static_cast<std::size_t>(plan.nv), 0.0),
      qd_(q_),
      qdd_(q_),
      drive_(q_),
      workspace_(plan),
      scratch_(q_) {
  int prescribed = 0;
  for (int i = 0; i < plan.nv; ++i)
    if (plan.joints[i].prescribed)
      motion_slot_[i] = prescribed++;
    else
      integrated_.push_back(i);
  inputs_.assign(q_.size() + 6 * plan.ports.size() + 3 * static_cast<std::size_t>(prescribed), 0.0);
}

void System::set_motion(double time, int joint, double q, double qd, double qdd) {
  double* held =
      &inputs_[q_.size() + 6 * plan_.ports.size() + 3 * static_cast<std::size_t>(motion_slot_[joint])];
  held[0] = time;
  held[1] = q;
  held[2] = qd;
  inputs_[joint] = qdd;
}

System::Coordinates System::coordinates(double time, const double* y) {
  if (plan_.prescribed_count == 0) return {y, y + plan_.nv};
  const double* held = &inputs_[q_.size() + 6 * plan_.ports.size()];
  for (int i = 0; i < plan_.nv; ++i) {
    if (motion_slot_[i] < 0) continue;
    const double since = time - held[0];
    q_[i] = held[1] + since * (held[2] + 0.5 * since * inputs_[i]);
    qd_[i] = held[2] + since * inputs_[i];
    held += 3;
  }
  for (int k = 0; k < nq(); ++k) {
    q_[integrated_[k]] = y[k];
    qd_[integrated_[k]] = y[nq() + k];
  }
  return {q_.data(), qd_.data()};
}

Status System::accelerations(double time, const double* y, double* qdd) {
  ++evaluations_;
  const Coordinates at = coordinates(time, y);
  compiled_forward_dynamics(plan_, workspace_, at.q, at.qd, inputs_.data(), qdd);
  // one sum finds any non-finite entry: inf - inf and nan are nan
  double sum = 0;
  for (int i = 0; i < plan_.nv; ++i) sum += qdd[i] * 0.0;
  if (sum == 0) return Status::ok;
  failed_joint_ = 0;
  while (failed_joint_ + 1 < plan_.nv && std::isfinite(qdd[failed_joint_])) ++failed_joint_;
  return Status::recoverable;
}

Status System::right_hand_side(double time, const double* y, double* ydot) {
  const int n = nq();
  const bool all = plan_.prescribed_count == 0;
  double* qdd = all ? ydot + n : qdd_.data();
  const Status status = accelerations(time, y, qdd);
  for (int k = 0; k < n; ++k) ydot[k] = y[n + k];
  if (!all)
    for (int k = 0; k < n; ++k) ydot[n + k] = qdd[integrated_[k]];
  if (with_work_) ydot[2 * n] = power(coordinates(time, y), qdd);
  return status;
}

double System::power(const Coordinates& at, const double* qdd) {
  const double* tau = inputs_.data();
  if (plan_.prescribed_count > 0) {
    drive_forces(at, qdd, drive_.data());
    tau = drive_.data();
  }
  double power = external_power(plan_, workspace_, at.qd, tau);
  for (std::size_t k = 0; k < plan_.ports.size(); ++k)
    power += port_power(plan_, workspace_, plan_.ports[k], at.qd, port_wrench(static_cast<int>(k)));
  return power;
}

void System::drive_forces(const Coordinates& at, const double* qdd, double* tau) const {
  for (int i = 0; i < plan_.nv; ++i)
    tau[i] = plan_.joints[i].prescribed
                 ? prescribed_force(plan_.joints[i], workspace_.joints[i], at.q[i], at.qd[i], qdd[i])
                 : inputs_[i];
}

double System::largest_gap() const { return largest(workspace_.loop.residual); }

void System::set_residuals(double time, const double* y) {
  const Coordinates at = coordinates(time, y);
  set_positions(plan_, workspace_, at.q);
  set_velocities(plan_, workspace_, at.qd);
  set_ground_motion(plan_, workspace_, at.qd);
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
  const int n = nq();
  // the elimination at the arriving point serves every correction: they are small
  if (accelerations(time, y, qdd_.data()) != Status::ok) return Status::recoverable;
  set_residuals(time, y);
  const double enough = rounding * workspace_.loop.extent;
  reduce_residual(workspace_.loop.residual, enough, time, y, y);
  reduce_residual(workspace_.loop.rate, enough * largest_of(coordinates(time, y).qd, plan_.nv), time, y,
                  y + n);
  if (!std::isfinite(largest(workspace_.loop.residual) + largest(workspace_.loop.rate)))
    return Status::recoverable;
  if (error != nullptr) project_error(error);
  return Status::ok;
}

// Adds to `part` (q or qd of the state) the response to the residuals in ws.loop.b.
void System::add_correction(double* part) {
  correct_loops(plan_, workspace_, scratch_.data());
  for (int k = 0; k < nq(); ++k) part[k] += scratch_[integrated_[k]];
}

// Newton corrections of `part` (q or qd in y) until `residual` is rounding or grows no smaller.
void System::reduce_residual(const std::vector<double>& residual, double enough, double time, const double* y,
                             double* part) {
  double size = largest(residual);
  for (int k = 0; size > enough && k < projection_iterations; ++k) {
    const double before = size;
    for (std::size_t row = 0; row < residual.size(); ++row) workspace_.loop.b[row] = -residual[row];
    add_correction(part);
    set_residuals(time, y);
    size = largest(residual);
    if (!(size < 0.5 * before)) break;
  }
}

// The error estimate loses what the projection takes away: its part across the constraints.
void System::project_error(double* error) {
  const int n = nq();
  for (double* part : {error, error + n}) {
    std::fill(qdd_.begin(), qdd_.end(), 0.0);
    for (int k = 0; k < n; ++k) qdd_[integrated_[k]] = part[k];
    // the rows' rates are linear in the velocity: take the error for one
    set_velocities(plan_, workspace_, qdd_.data());
    set_ground_motion(plan_, workspace_, qdd_.data());
    set_loop_residuals(plan_, workspace_);
    for (std::size_t row = 0; row < workspace_.loop.b.size(); ++row)
      workspace_.loop.b[row] = -workspace_.loop.rate[row];
    add_correction(part);
  }
}

double System::kinetic_energy(double time, const double* y) {
  const Coordinates at = coordinates(time, y);
  return redysim::kinetic_energy(plan_, workspace_, at.q, at.qd);
}

double System::potential_energy(double time, const double* y) {
  const Coordinates at = coordinates(time, y);
  return redysim::potential_energy(plan_, workspace_, at.q, at.qd);
}

}  // namespace redysim
