#include "integrate/tangent.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/aba.hpp"
#include "dynamics/assembly_tangent.hpp"
#include "dynamics/energy.hpp"
#include "dynamics/loop_correction.hpp"
#include "dynamics/momentum.hpp"

namespace redysim {
namespace {

Vec3<Dual> with(const Vec3<double>& value, const double* change) {
  return {Dual(value[0], change[0]), Dual(value[1], change[1]), Dual(value[2], change[2])};
}

void take_values(const double* from, std::size_t count, std::vector<Dual>& to) {
  to.assign(count, Dual(0));
  for (std::size_t i = 0; i < count; ++i) to[i] = Dual(from[i]);
}

}  // namespace

Tangent::Tangent(const Model& model, const System& system)
    : balls(static_cast<std::size_t>(system.balls())), plan_(model), workspace_(plan_) {
  angles_.resize(balls.size());
  ball_omega_.resize(balls.size());
  ball_torque_.resize(balls.size());
  ball_turn_.resize(balls.size());
  ball_quaternion_.resize(balls.size());
  moved_.resize(balls.size());
  if (features::control && system.control())
    control_ = std::make_unique<ControlTangent>(model, *system.control(),
                                                static_cast<std::size_t>(plan_.nv) + 6 * plan_.ports.size());
}

std::vector<Plan<Dual>*> Tangent::plans() {
  if (control() && control()->plan()) return {&plan_, control()->plan()};
  return {&plan_};
}

void Tangent::go_to(const Model& model, System& system, double time, const double* y) {
  const std::size_t n = static_cast<std::size_t>(plan_.nv);
  plan_.update(model);
  qdd.assign(n, Dual(0));
  drive = qdd;
  std::vector<double> unused(n);
  system.accelerations(time, y, unused.data());
  const System::Coordinates at = system.coordinates(time, y);
  take_values(at.q, n, q);
  take_values(at.qd, n, qd);
  take_values(system.forces(), n + 6 * plan_.ports.size() + 3 * balls.size(), force);
  for (std::size_t k = 0; k < balls.size(); ++k) {
    const int ball = static_cast<int>(k);
    balls[k] = {};
    angles_[k] = system.angles_of_ball(ball);
    ball_quaternion_[k] = Eigen::Map<const Eigen::Vector4d>(y + system.simple() + 4 * ball);
    ball_omega_[k] = Vec3<double>(y + system.nq() + system.simple() + 3 * ball);
    ball_torque_[k] = Vec3<double>(system.ball_force(ball));
  }
  with_time_ = false;
  if (control()) control()->go_to(model, system, time);
}

// A link's inertia about its own center of mass, seen from the body that carries it.
void Tangent::change_mass(int body, const Pose& frame, const Vec3<double>& com, double mass, double d_mass,
                          const Vec3<double>& d_com, const Mat3<double>& d_inertia) {
  const Vec3<double> c = frame.rotation * com + frame.position, dc = frame.rotation * d_com;
  const Mat3<double> unit = Mat3<double>::Identity();
  const Mat3<double> about_origin = frame.rotation * d_inertia * frame.rotation.transpose() +
                                    d_mass * (c.squaredNorm() * unit - c * c.transpose()) +
                                    mass * (2 * c.dot(dc) * unit - dc * c.transpose() - c * dc.transpose());
  constexpr int rows[] = {0, 1, 2, 0, 0, 1}, columns[] = {0, 1, 2, 1, 2, 2};
  for (Plan<Dual>* plan : plans()) {
    if (body == ground) {
      for (int k = 0; k < 3; ++k) plan->grounded[k].derivative += d_mass * c[k] + mass * dc[k];
      continue;
    }
    JointPlan<Dual>& joint = plan->joints[body];
    RigidInertia<Dual>& to = joint.inertia;
    to.mass.derivative += d_mass;
    for (int k = 0; k < 3; ++k) to.h[k].derivative += d_mass * c[k] + mass * dc[k];
    Dual* const entries[] = {&to.inertia.xx, &to.inertia.yy, &to.inertia.zz,
                             &to.inertia.xy, &to.inertia.xz, &to.inertia.yz};
    for (int k = 0; k < 6; ++k) entries[k]->derivative += about_origin(rows[k], columns[k]);
    joint.rigid = articulated(to);
  }
}

void Tangent::follow_jumps(System& system, double time, const double* y) {
  const std::size_t n = static_cast<std::size_t>(plan_.nv);
  // accelerations answer prescribed ones as positions and velocities answer their jumps
  std::vector<Dual> values(n), at_rest(force.size()), answer(n);
  for (std::size_t i = n; i < force.size(); ++i) at_rest[i] = Dual(force[i].value);
  const auto respond_to = [&](std::vector<Dual>& jump) {
    for (std::size_t i = 0; i < n; ++i) values[i] = Dual(q[i].value);
    std::vector<Dual> speed(n);
    for (std::size_t i = 0; i < n; ++i) speed[i] = Dual(qd[i].value);
    for (std::size_t i = 0; i < n; ++i)
      at_rest[i] = Dual(force[i].value, plan_.joints[i].prescribed ? jump[i].derivative : 0);
    forward_dynamics(plan_, workspace_, values.data(), speed.data(), at_rest.data(), answer.data());
    for (std::size_t i = 0; i < n; ++i) jump[i].derivative = answer[i].derivative;
  };
  respond_to(q);
  respond_to(qd);
  if (!plan_.has_loops()) return;
  // velocities stay closed where the positions have gone
  set_positions(plan_, workspace_, q.data());
  set_velocities(plan_, workspace_, qd.data());
  set_ground_motion(plan_, workspace_, qd.data());
  set_loop_residuals(plan_, workspace_);
  std::vector<double> unused(n), correction(n);
  system.accelerations(time, y, unused.data());
  LoopState<double>& loop = system.workspace().loop;
  for (std::size_t row = 0; row < loop.b.size(); ++row) loop.b[row] = -workspace_.loop.rate[row].derivative;
  correct_loops(system.plan(), system.workspace(), correction.data());
  for (std::size_t i = 0; i < n; ++i) qd[i].derivative += correction[i];
}

void Tangent::follow_assembly(const Model& model, const Assembly& assembly) {
  redysim::follow_assembly(model, assembly, plan_, workspace_, q, qd);
}

void Tangent::go_with_time(System& system, double time, const double* y) {
  std::vector<double> accelerations(static_cast<std::size_t>(plan_.nv));
  system.accelerations(time, y, accelerations.data());
  for (std::size_t i = 0; i < q.size(); ++i) {
    q[i].derivative = qd[i].value;
    qd[i].derivative = accelerations[i];
  }
  for (std::size_t i = 0; i < force.size(); ++i)
    force[i].derivative = system.input_slope(static_cast<int>(i));
  for (std::size_t k = 0; k < balls.size(); ++k)
    for (int i = 0; i < 3; ++i)
      balls[k].torque[i] = force[force.size() - 3 * balls.size() + 3 * k + i].derivative;
  with_time_ = true;
  if (control()) control()->go_with_time(system, time, force);
}

// A change of a quaternion is a turn, 2 conj(q) dq in link axes; angles, rates and forces of the joints that
// stand for it follow.
void Tangent::set_balls() {
  for (std::size_t k = 0; k < balls.size(); ++k) {
    const int first = plan_.balls[k] + 1;
    const BallAngles& a = angles_[k];
    if (!with_time_) {
      const Eigen::Vector4d& p = ball_quaternion_[k];
      const Eigen::Map<const Eigen::Vector4d> dp(balls[k].quaternion);
      const Vec3<double> v = p.tail<3>(), dv = dp.tail<3>();
      const Vec3<double> turn = 2 / p.squaredNorm() * (p[0] * dv - dp[0] * v - v.cross(dv));
      const Vec3<double> change = angle_rates(a, turn);
      for (int i = 0; i < 3; ++i) q[first + i].derivative += change[i];
    }
    const Vec3<double> change(q[first].derivative, q[first + 1].derivative, q[first + 2].derivative);
    ball_turn_[k] = rate_matrix(a) * change;
    moved_[k] = {a.turned, Dual(a.phi, change[0]), Dual(a.theta, change[1]), Dual(a.psi, change[2])};
    const Vec3<Dual> rates = angle_rates(moved_[k], with(ball_omega_[k], balls[k].omega));
    const Vec3<Dual> forces = rate_matrix(moved_[k]).transpose() * with(ball_torque_[k], balls[k].torque);
    for (int i = 0; i < 3; ++i) {
      if (!with_time_) qd[first + i].derivative += rates[i].derivative;
      force[first + i] = forces[i];
    }
  }
}

bool Tangent::evaluate() {
  set_balls();
  if (control()) control()->answer(q, qd, force);
  const std::size_t n = q.size();
  forward_dynamics(plan_, workspace_, q.data(), qd.data(), force.data(), qdd.data());
  multipliers = workspace_.loop.lambda;
  for (std::size_t i = 0; i < n; ++i)
    drive[i] = plan_.joints[i].prescribed
                   ? prescribed_force(plan_, workspace_, static_cast<int>(i), q.data(), qd.data(), qdd.data())
                   : force[i];
  power = external_power(plan_, workspace_, q.data(), qd.data(), drive.data());
  for (std::size_t k = 0; k < plan_.ports.size(); ++k)
    power += port_power(plan_, workspace_, plan_.ports[k], qd.data(), &force[n + 6 * k]);
  double sum = 0;
  for (const Dual& a : qdd) sum += a.value * 0.0 + a.derivative * 0.0;
  for (const Dual& a : drive) sum += a.derivative * 0.0;
  return sum == 0;
}

Dual Tangent::kinetic_energy() { return redysim::kinetic_energy(plan_, workspace_, q.data(), qd.data()); }

Dual Tangent::potential_energy() { return redysim::potential_energy(plan_, workspace_, q.data(), qd.data()); }

Force<Dual> Tangent::momentum() { return redysim::momentum(plan_, workspace_, q.data(), qd.data()); }

GroundState<Dual> Tangent::body(int index) {
  set_positions(plan_, workspace_, q.data());
  return body_motion(plan_, workspace_, index, qd.data());
}

Tangent::BallMotion Tangent::ball(int index) const {
  const int first = plan_.balls[index] + 1;
  const Vec3<Dual> rates(qd[first], qd[first + 1], qd[first + 2]);
  const Vec3<Dual> accelerations(qdd[first], qdd[first + 1], qdd[first + 2]);
  const Mat3<Dual> E = rate_matrix(moved_[index]);
  return {E * rates, E * accelerations + rate_bias(moved_[index], rates), ball_turn_[index]};
}

}  // namespace redysim
