#include "integrate/system/dense_jacobian.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/ball.hpp"

namespace redysim {

DenseJacobian::DenseJacobian(System& system)
    : system_(system),
      derivatives_(system.plan()),
      qdd_(static_cast<std::size_t>(system.plan().nv)),
      tau_(qdd_),
      change_(qdd_.size() + 1) {
  using Kind = JointVariable::Kind;
  for (Kind kind : {Kind::position, Kind::velocity})
    for (int k = 0; k < system.simple(); ++k) variables_.push_back({kind, system.joint_of(k)});
  for (int chart : system.plan().balls)
    for (Kind kind : {Kind::position, Kind::velocity, Kind::force})
      for (int k = 1; k <= 3; ++k) variables_.push_back({kind, chart + k});
  if (const Control* control = system.control())
    for (int joint : control->joints()) variables_.push_back({Kind::force, joint});
  columns_.resize(variables_.size() * change_.size());
}

Status DenseJacobian::evaluate(double time, const double* y, double* matrix) {
  const Status status = system_.accelerations(time, y, qdd_.data());
  if (status != Status::ok) return status;
  const System::Coordinates at = system_.coordinates(time, y);
  system_.drive_forces(at, qdd_.data(), tau_.data());
  derivatives_.evaluate(system_.plan(), system_.workspace(), at.q, at.qd, qdd_.data(), tau_.data(),
                        system_.recursion_port_wrenches(), variables_, columns_.data());
  if (system_.control()) system_.add_feedback(time, at, variables_, columns_.data());
  const StateLayout& layout = system_.layout();
  const std::ptrdiff_t size = system_.size();
  std::fill_n(matrix, size * size, 0.0);
  for (int k = 0; k < layout.q.count; ++k) {
    add_rows(column(k), matrix + layout.q[k] * size);
    double* by_velocity = matrix + layout.qd[k] * size;
    add_rows(column(layout.q.count + k), by_velocity);
    by_velocity[layout.q[k]] = 1;
  }
  for (int ball = 0; ball < system_.balls(); ++ball) set_ball(ball, y, matrix);
  // one sum finds any non-finite entry
  double sum = 0;
  for (std::ptrdiff_t i = 0; i < size * size; ++i) sum += matrix[i] * 0.0;
  return sum == 0 ? Status::ok : Status::recoverable;
}

// Rows of the velocities and the work from a change of the accelerations of all joints and of the power.
void DenseJacobian::add_rows(const double* change, double* column) const {
  const StateLayout& layout = system_.layout();
  for (int i = 0; i < layout.qd.count; ++i) column[layout.qd[i]] = change[system_.joint_of(i)];
  for (int ball = 0; ball < system_.balls(); ++ball) {
    const Eigen::Map<const Vec3<double>> accelerations(change + system_.plan().balls[ball] + 1);
    Eigen::Map<Vec3<double>>(layout.omega.of(column, ball)) =
        rate_matrix(system_.angles_of_ball(ball)) * accelerations;
  }
  if (system_.with_work()) *layout.work.of(column) = change[qdd_.size()];
}

// Columns of a spherical joint's quaternion and angular velocity, by the chain rule: dual numbers give the
// derivatives of its angles, rates and forces, `columns_` those of all accelerations by these.
void DenseJacobian::set_ball(int ball, const double* y, double* matrix) {
  const StateLayout& layout = system_.layout();
  const int chart = system_.plan().balls[ball];
  const std::ptrdiff_t size = system_.size();
  const double* quaternion = layout.quaternion.of(y, ball);
  const Vec3<double> omega(layout.omega.of(y, ball)), torque(system_.recursion_ball_torque(ball));
  const BallAngles angles = system_.angles_of_ball(ball);
  const double* columns = column(2 * layout.q.count + 9 * ball);
  double squared = 0;
  for (int k = 0; k < 4; ++k) squared += quaternion[k] * quaternion[k];
  for (int variable = 0; variable < 7; ++variable) {
    const bool velocity = variable >= 4;
    double* column =
        matrix + size * (velocity ? layout.omega[ball] + variable - 4 : layout.quaternion[ball] + variable);
    double unit[4] = {0, 0, 0, 0};
    unit[velocity ? variable - 4 : variable] = 1;
    quaternion_rate(velocity ? quaternion : unit, velocity ? unit : omega.data(),
                    layout.quaternion.of(column, ball));

    // rotation vector of a change of the quaternion: vector part of 2 conj(q) dq
    Vec3<double> turn = Vec3<double>::Zero(), spin = turn;
    if (velocity) {
      spin[variable - 4] = 1;
    } else {
      const Eigen::Map<const Vec3<double>> v(quaternion + 1), dv(unit + 1);
      turn = 2 / squared * (quaternion[0] * dv - unit[0] * v - v.cross(dv));
    }
    const Vec3<double> angle_change = angle_rates(angles, turn);
    const BallAnglesOf<Dual> moved{angles.turned, Dual(angles.phi, angle_change[0]),
                                   Dual(angles.theta, angle_change[1]), Dual(angles.psi, angle_change[2])};
    Vec3<Dual> rates = omega.cast<Dual>();
    for (int k = 0; k < 3; ++k) rates[k].derivative = spin[k];
    rates = angle_rates(moved, rates);
    const Vec3<Dual> forces = rate_matrix(moved).transpose() * Vec3<Dual>(torque.cast<Dual>());

    std::fill(change_.begin(), change_.end(), 0.0);
    for (int k = 0; k < 9; ++k) {
      const double factor = k < 3   ? angle_change[k]
                            : k < 6 ? rates[k - 3].derivative
                                    : forces[k - 6].derivative;
      for (std::size_t i = 0; i < change_.size(); ++i)
        change_[i] += factor * columns[static_cast<std::size_t>(k) * change_.size() + i];
    }
    add_rows(change_.data(), column);
    // the link axes rotate as well
    const Eigen::Map<const Vec3<double>> held(&qdd_[static_cast<std::size_t>(chart) + 1]);
    const Vec3<Dual> own = rate_matrix(moved) * Vec3<Dual>(held.cast<Dual>()) + rate_bias(moved, rates);
    for (int k = 0; k < 3; ++k) column[layout.omega[ball] + k] += own[k].derivative;
  }
}

}  // namespace redysim
