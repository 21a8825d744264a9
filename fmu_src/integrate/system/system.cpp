#include "integrate/system/system.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "dynamics/bias.hpp"
#include "dynamics/compiled.hpp"
#include "dynamics/energy.hpp"
#include "dynamics/loops/coupling_rows.hpp"
#include "dynamics/loops/loop_correction.hpp"
#include "dynamics/loops/loop_levers.hpp"
#include "dynamics/straight_line/straight_line.hpp"

namespace redysim {

namespace {

// Whether this library holds straight-line code of a model with constraints.
constexpr bool compiles_loops = features::straight_line && features::loops;

// The quaternion of a rotation, with the sign closer to the previous one.
void write_quaternion(const Mat3<double>& rotation, double* quaternion) {
  const Eigen::Quaterniond q(rotation);
  const double values[] = {q.w(), q.x(), q.y(), q.z()};
  double same = 0;
  for (int k = 0; k < 4; ++k) same += values[k] * quaternion[k];
  for (int k = 0; k < 4; ++k) quaternion[k] = same < 0 ? -values[k] : values[k];
}

}  // namespace

System::Coordinates System::coordinates(double time, const double* y) {
  // a spherical joint has a prescribed joint as its chart, so has_motion() is true
  return plan_.has_motion() ? coordinates_of_all(time, y) : Coordinates{y, y + plan_.nv};
}

System::Coordinates System::coordinates_of_all(double time, const double* y) {
  for (int i = 0; i < plan_.nv; ++i) {
    if (motion_slot_[i] < 0) continue;
    q_[i] = motion_at(time, i, 0);
    qd_[i] = motion_at(time, i, 1);
  }
  if (control()) control_->set_motions(time, phases(), q_.data(), qd_.data());
  for (int k = 0; k < simple(); ++k) {
    q_[integrated_[k]] = y[k];
    qd_[integrated_[k]] = y[layout_.qd[k]];
  }
  for (int ball = 0; ball < balls(); ++ball) expand_ball(ball, y);
  return {q_.data(), qd_.data()};
}

// Quaternion and angular velocity -> angles, rates and torques of the joints that represent them.
void System::expand_ball(int ball, const double* y) {
  const int chart = plan_.balls[ball];
  const Vec3<double> omega(layout_.omega.of(y, ball)), torque(recursion_ball_torque(ball));
  const Mat3<double> rotation = rotation_of(layout_.quaternion.of(y, ball));
  BallAngles& angles = angles_[ball];
  angles = charts_kept_ ? angles_in_chart(rotation, angles.turned) : ball_angles(rotation);
  const Vec3<double> rates = angle_rates(angles, omega);
  const Vec3<double> forces = rate_matrix(angles).transpose() * torque;
  std::copy_n(joint_positions(angles).begin(), 4, &q_[chart]);
  for (int k = 0; k < 3; ++k) {
    qd_[chart + 1 + k] = rates[k];
    recursion_inputs_[chart + 1 + k] = forces[k];
  }
}

[[gnu::cold]] void System::collect(const double* q, const double* qd, double* y) const {
  for (int k = 0; k < simple(); ++k) {
    y[k] = q[integrated_[k]];
    y[layout_.qd[k]] = qd[integrated_[k]];
  }
  for (int ball = 0; ball < balls(); ++ball) {
    const int first = plan_.balls[ball] + 1;
    const BallAngles angles{q[first - 1] != 0, q[first], q[first + 1], q[first + 2]};
    write_quaternion(rotation_of(angles), layout_.quaternion.of(y, ball));
    const Eigen::Map<const Vec3<double>> rates(qd + first);
    Eigen::Map<Vec3<double>>(layout_.omega.of(y, ball)) = rate_matrix(angles) * rates;
  }
}

Vec3<double> System::ball_acceleration(int ball, const double* qdd) const {
  const int first = plan_.balls[ball] + 1;
  const Vec3<double> rates(&qd_[first]), accelerations(qdd + first);
  return rate_matrix(angles_[ball]) * accelerations + rate_bias(angles_[ball], rates);
}

Status System::accelerations(double time, const double* y, double* qdd) {
  return accelerations<true>(time, y, qdd);
}

// Coordinates and recursion inputs of all joints at (time, y), if these differ from y and inputs_.
System::Coordinates System::coordinates_and_inputs(double time, const double* y) {
  if (!recursion_inputs_.empty()) update_recursion_inputs(time);
  const Coordinates at = coordinates(time, y);
  if (control()) control_->apply(time, phases(), at.q, at.qd, recursion_inputs_.data());
  if (actuators()) actuators_->apply(y, recursion_inputs_.data());
  return at;
}

template <bool fill_workspace>
Status System::accelerations(double time, const double* y, double* qdd) {
  ++evaluations_;
  Coordinates at{y, y + plan_.nv};
  if (plan_.has_motion() || !recursion_inputs_.empty()) at = coordinates_and_inputs(time, y);
  constexpr bool tries_line = features::straight_line && !fill_workspace;
  if constexpr (tries_line)
    by_line_ = !rank_is_held_ &&
               straight_line_forward_dynamics(plan_, at.q, at.qd, line_inputs(at), qdd, drive_.data());
  if (!tries_line || !by_line_)
    compiled_forward_dynamics(plan_, workspace_, at.q, at.qd, recursion_inputs(), qdd);
  // one sum finds any non-finite entry: inf - inf and nan are nan
  double sum = 0;
  for (int i = 0; i < plan_.nv; ++i) sum += qdd[i] * 0.0;
  if (sum == 0) return Status::ok;
  failed_joint_ = 0;
  while (failed_joint_ + 1 < plan_.nv && std::isfinite(qdd[failed_joint_])) ++failed_joint_;
  return Status::recoverable;
}

// Inputs of straight-line code, which contains friction and stops only with Taylor series.
const double* System::line_inputs(const Coordinates& at) {
  if (line_inputs_.empty()) return recursion_inputs();
  std::copy_n(recursion_inputs(), line_inputs_.size(), line_inputs_.begin());
  for (int i = 0; i < plan_.nv; ++i)
    if (plan_.joints[i].has_resistance && !plan_.joints[i].prescribed)
      line_inputs_[i] += resistance_force(plan_, i, at.q[i], at.qd[i]);
  return line_inputs_.data();
}

Status System::right_hand_side(double time, const double* y, double* ydot) {
  const Status status = slope_within_step(time, y, ydot);
  if (contact_search_) {
    std::copy_n(plan_.has_motion() ? qdd_.data() : layout_.qd.of(ydot), plan_.nv, searched_.begin() + 1);
    note_searched(status == Status::ok ? time : NAN);
  }
  return status;
}

void System::note_searched(double time) {
  searched_[0] = time;
  std::memcpy(&searched_.back(), &workspace_.contact_regions, sizeof(double));
}

std::uint64_t System::contact_regions() const {
  std::uint64_t regions = 0;
  if (contact_search_) std::memcpy(&regions, &searched_.back(), sizeof(double));
  return regions;
}

Status System::slope_within_step(double time, const double* y, double* ydot) {
  const bool some = plan_.has_motion();
  double* qdd = some ? qdd_.data() : layout_.qd.of(ydot);
  const Status status = accelerations<false>(time, y, qdd);
  std::copy_n(layout_.qd.of(y), layout_.q.count, ydot);
  if (some) slope_of_integrated(y, qdd, ydot);
  if (with_work()) {
    const Coordinates at = some ? Coordinates{q_.data(), qd_.data()} : Coordinates{y, y + plan_.nv};
    *layout_.work.of(ydot) = power(at, qdd);
  }
  if (layout_.work.count > 1) layout_.work.of(ydot)[1] = workspace_.contact_power;
  if (actuators()) add_actuators(y, ydot);
  return status;
}

void System::slope_from(const double* y, const double* qdd, double* ydot) const {
  std::copy_n(layout_.qd.of(y), layout_.q.count, ydot);
  slope_of_integrated(y, qdd, ydot);
  if (actuators()) actuators_->set_slopes(y, ydot);
}

// The slope of velocities and quaternions from the accelerations of all joints.
void System::slope_of_integrated(const double* y, const double* qdd, double* ydot) const {
  for (int k = 0; k < simple(); ++k) ydot[layout_.qd[k]] = qdd[integrated_[k]];
  for (int ball = 0; ball < balls(); ++ball) {
    quaternion_rate(layout_.quaternion.of(y, ball), layout_.omega.of(y, ball),
                    layout_.quaternion.of(ydot, ball));
    Eigen::Map<Vec3<double>>(layout_.omega.of(ydot, ball)) = ball_acceleration(ball, qdd);
  }
}

// Sets the slopes of actuator states; adds the actuator power that joint torques do not contain.
[[gnu::noinline]] void System::add_actuators(const double* y, double* ydot) const {
  actuators_->set_slopes(y, ydot);
  if (with_work()) *layout_.work.of(ydot) += actuators_->power();
}

double System::power(const Coordinates& at, const double* qdd) {
  const double* drive = input_layout_.tau.of(recursion_inputs());
  if (plan_.has_motion()) {
    if (evaluated_by_line())
      complete_drive_forces(at);
    else
      drive_forces(at, qdd, drive_.data());
    drive = drive_.data();
  }
  if (evaluated_by_line() && (plan_.has_springs() || plan_.has_ports()))
    compiled_ground_motion(plan_, workspace_, at.q, at.qd);
  double power = external_power(plan_, workspace_, at.q, at.qd, drive);
  for (int k = 0; k < input_layout_.port_wrench.count; ++k) power += port_power(at, k);
  return power;
}

[[gnu::cold]] double System::port_power(const Coordinates& at, int port) const {
  return redysim::port_power(plan_, workspace_, plan_.ports[port], at.qd,
                             input_layout_.port_wrench.of(recursion_inputs(), port));
}

void System::drive_forces(const Coordinates& at, const double* qdd, double* drive) const {
  for (int i = 0; i < plan_.nv; ++i)
    drive[i] = plan_.joints[i].prescribed ? compiled_prescribed_force(plan_, workspace_, i, at.q, at.qd, qdd)
                                          : recursion_inputs()[input_layout_.tau[i]];
}

// Adds to drive_, prescribed forces by straight-line code, what that does not contain.
void System::complete_drive_forces(const Coordinates& at) {
  for (int i = 0; i < plan_.nv; ++i)
    if (!plan_.joints[i].prescribed)
      drive_[i] = recursion_inputs()[input_layout_.tau[i]];
    else if (!line_inputs_.empty() && plan_.joints[i].has_resistance)
      drive_[i] -= resistance_force(plan_, i, at.q[i], at.qd[i]);
}

bool System::enter_samples(double time, const double* y) {
  if (!control() || !control_->is_sampled()) return false;
  update_recursion_inputs(time);
  // the next step starts after the jumps
  if (jumped()) {
    std::copy_n(y, size(), sampled_state_.begin());
    follow_jumps(time, sampled_state_.data());
    y = sampled_state_.data();
  }
  const Coordinates at = coordinates(time, y);
  return control_->enter_samples(time, phases(), at.q, at.qd, recursion_inputs_.data());
}

double System::next_breakpoint(double time) const {
  return control() ? control_->next_breakpoint(time, phases()) : std::numeric_limits<double>::infinity();
}

void System::add_feedback(double time, const Coordinates& at, const std::vector<JointVariable>& variables,
                          double* columns, std::size_t length) {
  if (controller_holds()) return;
  if (actuators()) actuators_->exchange_inputs(recursion_inputs_.data());
  control_->add_feedback(time, phases(), at.q, at.qd, recursion_inputs(), variables, columns, length);
  if (actuators()) actuators_->exchange_inputs(recursion_inputs_.data());
}

bool System::loops_are_violated() const {
  return plan_.has_constraints() && relative_violation(workspace_.loop, false) > violation;
}

int System::independent_rows() const {
  if (evaluated_by_line()) return rows();
  int rank = 0;
  for (std::size_t c = 0; c < plan_.clusters.size(); ++c)
    rank +=
        is_by_fronts(plan_, workspace_.loop, c) ? plan_.clusters[c].row_count : workspace_.loop.S[c].rank();
  return rank;
}

void System::hold_rank(bool hold) {
  rank_is_held_ = hold;
  for (auto& S : workspace_.loop.S) S.hold_rank(hold);
}

void System::set_residuals(double time, const double* y, bool with_sizes) {
  const Coordinates at = coordinates(time, y);
  if constexpr (compiles_loops)
    if (corrects_by_matrix_) return straight_line_residuals(plan_, at.q, at.qd, workspace_.loop);
  compiled_ground_motion(plan_, workspace_, at.q, at.qd);
  set_constraint_residuals(plan_, workspace_, at.q, at.qd, with_sizes);
}

// Whether no row was near dependence in the last elimination, so that no pivot tolerance changes it.
bool System::has_clear_rank() const {
  bool clear = true;
  for (std::size_t c = 0; c < plan_.clusters.size(); ++c) {
    const auto& S = workspace_.loop.S[c];
    clear = clear && (is_by_fronts(plan_, workspace_.loop, c) || (S.rank() == S.size() && !S.doubtful()));
  }
  return clear;
}

Status System::project(double time, double* y, double* error, bool evaluated) {
  if (!plan_.has_constraints()) return Status::ok;
  if (compiles_loops && !error && close_by_matrix(time, y)) return Status::ok;
  workspace_.loop.pivot_tolerance = projection_pivot_tolerance;
  const bool eliminated = evaluated && !features::straight_line && has_clear_rank();
  Status status = project_within_rank(time, y, error, eliminated);
  if (status == Status::ok && relative_violation(workspace_.loop, false) > rank_violation) {
    // constraints that are nearly dependent everywhere, not only near this position
    workspace_.loop.pivot_tolerance = dynamics_pivot_tolerance;
    status = project_within_rank(time, y, error, false);
  }
  workspace_.loop.pivot_tolerance = dynamics_pivot_tolerance;
  return status;
}

bool System::close_within_step(double time, double* y) {
  return (!compiles_loops && close_by_matrix(time, y) && !loops_are_violated()) || close_loops(time, y);
}

// `project` by one matrix for all corrections. False: it cannot close the loops, y is unchanged.
bool System::close_by_matrix(double time, double* y) {
  if (corrections_.empty() || rank_is_held_ || !set_corrections(time, y)) return false;
  corrects_by_matrix_ = true;
  const Status status = reduce_residuals(time, y);
  corrects_by_matrix_ = false;
  if (status == Status::ok && !(relative_violation(workspace_.loop, false) > rank_violation)) return true;
  std::copy(before_closing_.begin(), before_closing_.end(), y);
  return false;
}

bool System::set_corrections(double time, const double* y) {
  if constexpr (compiles_loops)
    return straight_line_corrections(plan_, coordinates(time, y).q, corrections_.data());
  set_residuals(time, y);
  return factor_levers(plan_, workspace_, corrections_.data(), gram_.data());
}

Status System::project_within_rank(double time, double* y, double* error, bool eliminated) {
  // one elimination at the start is used for all corrections: they are small
  if (!eliminated && accelerations(time, y, qdd_.data()) != Status::ok) return Status::recoverable;
  const Status status = reduce_residuals(time, y);
  if (status == Status::ok && error != nullptr) project_error(error);
  return status;
}

// Corrects q, then qd in y. A correction of q that diverges is undone.
Status System::reduce_residuals(double time, double* y) {
  charts_kept_ = true;
  if (compiles_loops || !corrects_by_matrix_) set_residuals(time, y);
  std::copy_n(y, size(), before_closing_.begin());
  const double before = relative_violation(workspace_.loop, false);
  double gap = reduce_residual(time, y, false);
  if (!(gap <= std::max(before, rank_violation))) {
    std::copy(before_closing_.begin(), before_closing_.end(), y);
    set_residuals(time, y);
    gap = before > violation ? NAN : before;
  }
  const double rate = reduce_residual(time, y, true);
  charts_kept_ = false;
  return std::isfinite(gap + rate) ? Status::ok : Status::recoverable;
}

// Corrects q or qd of the state by the residuals in ws.loop.b.
void System::add_correction(double* y, bool velocity) {
  if (corrects_by_matrix_) {
    std::vector<double>& b = workspace_.loop.b;
    if constexpr (!compiles_loops) solve_levers(gram_.data(), b);
    for (std::size_t i = 0; i < scratch_.size(); ++i)
      scratch_[i] = std::inner_product(b.begin(), b.end(), &corrections_[i * b.size()], 0.0);
  } else {
    correct_loops(plan_, workspace_, scratch_.data());
  }
  add_change(scratch_.data(), y, velocity);
}

// Adds a change of q or qd of all joints to the state, near the coordinates of the last expansion.
void System::add_change(const double* change, double* y, bool velocity) const {
  double* part = (velocity ? layout_.qd : layout_.q).of(y);
  for (int k = 0; k < simple(); ++k) part[k] += change[integrated_[k]];
  for (int ball = 0; ball < balls(); ++ball) {
    const double* angles = change + plan_.balls[ball] + 1;
    if (velocity) {
      Eigen::Map<Vec3<double>>(layout_.omega.of(y, ball)) +=
          rate_matrix(angles_[ball]) * Eigen::Map<const Vec3<double>>(angles);
      continue;
    }
    BallAngles moved = angles_[ball];
    moved.phi += angles[0];
    moved.theta += angles[1];
    moved.psi += angles[2];
    write_quaternion(rotation_of(moved), layout_.quaternion.of(y, ball));
  }
}

// Newton corrections of q or qd in y until each residual is a rounding error or stops decreasing. Returns the
// relative violation that remains.
double System::reduce_residual(double time, double* y, bool velocity) {
  const std::vector<double>& residual = velocity ? workspace_.loop.rate : workspace_.loop.residual;
  progress_.restart();
  for (int k = 0; k < projection_iterations && progress_.goes_on(workspace_.loop, velocity, rounding); ++k) {
    for (std::size_t row = 0; row < residual.size(); ++row) workspace_.loop.b[row] = -residual[row];
    add_correction(y, velocity);
    set_residuals(time, y, false);
  }
  return relative_violation(workspace_.loop, velocity);
}

// Removes from a velocity of all joints the part that violates the loop constraints, in the mass metric. Uses
// the elimination of the last accelerations.
void System::make_tangential(double* velocity) {
  // the rates of the rows are linear in the velocity
  set_ground_motion(plan_, workspace_, velocity);
  set_loop_residuals(plan_, workspace_, false);
  if (!plan_.couplings.empty()) set_coupling_rates(plan_, workspace_.loop, velocity);
  for (std::size_t row = 0; row < workspace_.loop.b.size(); ++row)
    workspace_.loop.b[row] = -workspace_.loop.rate[row];
  correct_loops(plan_, workspace_, scratch_.data());
  for (int i = 0; i < plan_.nv; ++i) velocity[i] += scratch_[i];
}

// Removes from the error estimate the part that violates the constraints, as the projection does for the
// state. Joints with one degree of freedom only.
void System::project_error(double* error) {
  for (double* part : {layout_.q.of(error), layout_.qd.of(error)}) {
    std::fill(drive_.begin(), drive_.end(), 0.0);
    for (int k = 0; k < simple(); ++k) drive_[integrated_[k]] = part[k];
    make_tangential(drive_.data());
    for (int k = 0; k < simple(); ++k) part[k] = drive_[integrated_[k]];
  }
}

[[gnu::cold]] void System::project_velocity(double* velocity) {
  if (!plan_.has_constraints()) return;
  std::fill(drive_.begin(), drive_.end(), 0.0);
  for (int k = 0; k < simple(); ++k) drive_[integrated_[k]] = velocity[layout_.qd[k] - nq()];
  const auto omega = [&](int ball) {
    return Eigen::Map<Vec3<double>>(velocity + layout_.omega[ball] - nq());
  };
  const auto rates = [&](int ball) { return Eigen::Map<Vec3<double>>(&drive_[plan_.balls[ball] + 1]); };
  for (int ball = 0; ball < balls(); ++ball)
    rates(ball) = angle_rates(angles_[ball], Vec3<double>(omega(ball)));
  make_tangential(drive_.data());
  for (int k = 0; k < simple(); ++k) velocity[layout_.qd[k] - nq()] = drive_[integrated_[k]];
  for (int ball = 0; ball < balls(); ++ball)
    omega(ball) = rate_matrix(angles_[ball]) * Vec3<double>(rates(ball));
}

[[gnu::cold]] void System::cancel_rates(const std::vector<Dual>& rates, double* change) {
  for (std::size_t row = 0; row < rates.size(); ++row) workspace_.loop.b[row] = -rates[row].derivative;
  add_correction(change, true);
}

double System::step_to_touch(double time, const double* y, double h, bool or_separation) {
  if (control()) h = std::min(h, step_limits(time).longest);
  // accelerations of the last stage or iteration are accurate enough for the next step
  if (time != searched_[0]) {
    searched_[0] = NAN;
    if (accelerations(time, y, &searched_[1]) != Status::ok) return h;
    note_searched(time);
  }
  if (control()) control_->set_mean_accelerations(time, h, phases(), &searched_[1]);
  const Coordinates at = coordinates(time, y);
  return contact_search_->step_to_touch(plan_, workspace_, at.q, at.qd, &searched_[1], h, or_separation);
}

double System::passed_touch(double time, const double* y, double h) {
  const Coordinates at = coordinates(time, y);
  return contact_search_->passed_touch(plan_, workspace_, at.q, at.qd, h);
}

[[gnu::cold]] double System::energy(const double* q, const double* qd, const double* y) {
  double energy =
      redysim::kinetic_energy(plan_, workspace_, q, qd) + redysim::potential_energy(plan_, workspace_, q, qd);
  for (int k = 0; actuators() && k < actuators_->size(); ++k)
    energy += actuators_->kinetic_energy(k, y) +
              actuators_->potential_energy(k, actuators_->law(k), y, q[actuators_->joint(k)]);
  return energy;
}

[[gnu::cold]] double System::energy_scale(double time, const double* y) {
  const Coordinates at = coordinates(time, y);
  for (int i = 0; i < plan_.nv; ++i) scratch_[i] = at.qd[i] + std::copysign(1.0, at.qd[i]);
  for (int k = 0; k < simple(); ++k) {
    const double qd = at.qd[joint_of(k)];
    scratch_[joint_of(k)] = qd + std::copysign(scales_[k], qd);
  }
  return redysim::kinetic_energy(plan_, workspace_, at.q, scratch_.data());
}

double System::kinetic_energy(double time, const double* y) {
  const Coordinates at = coordinates(time, y);
  double energy = redysim::kinetic_energy(plan_, workspace_, at.q, at.qd);
  for (int k = 0; actuators() && k < actuators_->size(); ++k) energy += actuators_->kinetic_energy(k, y);
  return energy;
}

[[gnu::cold]] double System::potential_energy(double time, const double* y) {
  const Coordinates at = coordinates(time, y);
  double energy = redysim::potential_energy(plan_, workspace_, at.q, at.qd);
  for (int k = 0; actuators() && k < actuators_->size(); ++k)
    energy += actuators_->potential_energy(k, actuators_->law(k), y, at.q[actuators_->joint(k)]);
  return energy;
}

}  // namespace redysim
