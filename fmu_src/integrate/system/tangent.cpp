#include "integrate/system/tangent.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "dynamics/aba.hpp"
#include "dynamics/assembly/assembly_tangent.hpp"
#include "dynamics/energy.hpp"
#include "dynamics/loops/cluster_rows.hpp"
#include "dynamics/loops/loop_correction.hpp"
#include "dynamics/momentum.hpp"
#include "integrate/system/independent_coordinates.hpp"
#include "math/complete_pivoting.hpp"

namespace redysim {
namespace {

Vec3<Dual> with(const Vec3<double>& value, const double* change) {
  return {Dual(value[0], change[0]), Dual(value[1], change[1]), Dual(value[2], change[2])};
}

BallAngles values_of(const BallAnglesOf<Dual>& angles) {
  return {angles.turned, angles.phi.value, angles.theta.value, angles.psi.value};
}

// Rotation vector, in link axes, of a change of a quaternion or of angles.
Vec3<double> turn_of(const Eigen::Vector4d& p, const double* change) {
  constexpr double rounding = 2e-15;  // for changes of the length only
  const Vec3<double> turn = rotation_vector(p.data(), change);
  const bool is_rounding =
      turn.norm() * p.norm() <= rounding * Eigen::Map<const Eigen::Vector4d>(change).norm();
  return is_rounding ? Vec3<double>::Zero() : turn;
}
Vec3<double> turn_of(const BallAnglesOf<Dual>& angles) {
  const Vec3<double> change(angles.phi.derivative, angles.theta.derivative, angles.psi.derivative);
  return rate_matrix(values_of(angles)) * change;
}

// Values and derivatives.
std::pair<Eigen::Vector4d, Eigen::Vector4d> parts_of(const Dual* quaternion) {
  std::pair<Eigen::Vector4d, Eigen::Vector4d> parts;
  for (int i = 0; i < 4; ++i) {
    parts.first[i] = quaternion[i].value;
    parts.second[i] = quaternion[i].derivative;
  }
  return parts;
}

void set_values(const double* from, std::size_t count, std::vector<Dual>& to) {
  to.assign(count, Dual(0));
  for (std::size_t i = 0; i < count; ++i) to[i] = Dual(from[i]);
}

}  // namespace

Tangent::Tangent(const Model& model, const System& system)
    : balls(static_cast<std::size_t>(system.balls())),
      plan_(system.plan()),
      workspace_(plan_),
      actuators_(system.actuators()) {
  angles_.resize(balls.size());
  ball_omega_.resize(balls.size());
  ball_turn_.resize(balls.size());
  ball_quaternion_.resize(balls.size());
  moved_.resize(balls.size());
  if (features::control && system.control()) control_ = std::make_unique<ControlTangent>(*system.control());
  actuator_inputs_.resize(static_cast<std::size_t>(actuator_count()));
  responses_.resize(actuator_inputs_.size());
  if (SensedWrenches<Dual>::needed(model))
    sensed_ = std::make_unique<SensedWrenches<Dual>>(model, system.plan());
  if (EquationTerms<Dual>::needed(model)) terms_ = std::make_unique<EquationTerms<Dual>>(model, plan_);
}

void Tangent::go_to(const Parameters<double>& given, System& system, double time, const double* y) {
  const std::size_t n = static_cast<std::size_t>(plan_.nv);
  parameters = given.cast<Dual>();
  qdd.assign(n, Dual(0));
  drive = qdd;
  std::vector<double> unused(n);
  system.accelerations(time, y, unused.data());
  const System::Coordinates at = system.coordinates(time, y);
  set_values(at.q, n, q);
  set_values(at.qd, n, qd);
  inputs_ = system.input_layout();
  set_values(system.recursion_inputs(), static_cast<std::size_t>(inputs_.force_size()), force);
  if (actuators_) set_values(y, static_cast<std::size_t>(system.size()), state_);
  for (int k = 0; k < actuator_count(); ++k) force[actuators_->joint(k)] = Dual(actuators_->input(k));
  for (std::size_t k = 0; k < balls.size(); ++k) {
    const int ball = static_cast<int>(k);
    balls[k] = {};
    angles_[k] = system.angles_of_ball(ball);
    ball_quaternion_[k] = Eigen::Map<const Eigen::Vector4d>(system.layout().quaternion.of(y, ball));
    ball_omega_[k] = Vec3<double>(system.layout().omega.of(y, ball));
  }
  with_time_ = false;
  if (control()) control()->go_to(system, time);
}

void Tangent::apply_parameters() {
  plan_.update(parameters);
  if (sensed_) sensed_->update(parameters);
  if (control()) control()->update(parameters);
  for (std::size_t i = 0; i < q.size(); ++i) {
    const JointParameters<Dual>& start = parameters.joints[plan_.joints[i].link];
    q[i].derivative += start.q0.derivative;
    qd[i].derivative += start.qd0.derivative;
  }
  for (std::size_t k = 0; k < balls.size(); ++k) {
    const auto& [quaternion, omega] = parameters.balls[k];
    const auto [values, change] = parts_of(quaternion.data());
    Eigen::Vector4d rate;  // of the state, which has unit length
    quaternion_rate(values.normalized().eval().data(), turn_of(values, change.data()).data(), rate.data());
    for (int i = 0; i < 4; ++i) balls[k].quaternion[i] += rate[i];
    for (int i = 0; i < 3; ++i) balls[k].omega[i] += omega[i].derivative;
  }
}

// The angles of a spherical joint among the coordinates of all joints.
BallAnglesOf<Dual> Tangent::angles_in(const Duals& at, int ball) const {
  const Dual* angles = &at[plan_.balls[ball]];
  return {angles[0].value != 0, angles[1], angles[2], angles[3]};
}

Vec3<Dual> Tangent::omega_in(const Duals& at, const Duals& speed, int ball) const {
  return rate_matrix(angles_in(at, ball)) * Eigen::Map<const Vec3<Dual>>(&speed[plan_.balls[ball] + 1]);
}

void Tangent::put_ball(int ball, const BallAngles& angles, const Vec3<double>& turn, const Vec3<Dual>& omega,
                       Duals& at, Duals& speed) const {
  const int first = plan_.balls[ball] + 1;
  const std::array<double, 4> values = joint_positions(angles);
  const Vec3<double> change = angle_rates(angles, turn);
  at[first - 1] = Dual(values[0]);
  for (int i = 0; i < 3; ++i) at[first + i] = Dual(values[i + 1], change[i]);
  const Vec3<Dual> rates = angle_rates(angles_in(at, ball), omega);
  for (int i = 0; i < 3; ++i) speed[first + i] = rates[i];
}

// Transfers directions from coordinates, in any chart, to q, qd and balls.
void Tangent::set_directions(const Duals& at, const Duals& speed) {
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (plan_.joints[i].of_ball) continue;
    q[i].derivative = at[i].derivative;
    qd[i].derivative = speed[i].derivative;
  }
  for (std::size_t k = 0; k < balls.size(); ++k) {
    const BallAnglesOf<Dual> angles = angles_in(at, static_cast<int>(k));
    const Vec3<double> turn = turn_of(angles);
    const Vec3<Dual> omega = omega_in(at, speed, static_cast<int>(k));
    Eigen::Map<Eigen::Vector4d> direction(balls[k].quaternion);
    const Eigen::Vector4d& at_quaternion = ball_quaternion_[k];
    const double lengthening = at_quaternion.dot(direction) / at_quaternion.squaredNorm();
    quaternion_rate(at_quaternion.data(), turn.data(), direction.data());
    direction += lengthening * at_quaternion;  // which turns nothing
    for (int i = 0; i < 3; ++i) balls[k].omega[i] = omega[i].derivative;
  }
}

// Changes the coordinates to the charts that System uses there.
void Tangent::renew_charts(Duals& at, Duals& speed) const {
  for (std::size_t k = 0; k < balls.size(); ++k) {
    const int ball = static_cast<int>(k);
    const BallAnglesOf<Dual> angles = angles_in(at, ball);
    put_ball(ball, ball_angles(rotation_of(values_of(angles))), turn_of(angles), omega_in(at, speed, ball),
             at, speed);
  }
}

// As System::follow_jumps.
void Tangent::follow_jumps(System& system, double time, const double* y) {
  const System::Coordinates from = system.coordinates(time, y);
  const std::size_t n = q.size();
  Duals at(n), speed(n), jump(n);
  for (std::size_t i = 0; i < n; ++i) {
    at[i] = Dual(from.q[i], q[i].derivative);
    speed[i] = Dual(from.qd[i], qd[i].derivative);
  }
  for (const bool velocity : {false, true}) {
    for (std::size_t i = 0; i < n; ++i)
      jump[i] = Dual(system.jump(static_cast<int>(i), velocity), (velocity ? qd : q)[i].derivative);
    add(answer_to(jump, at), velocity, at, speed);
    renew_charts(at, speed);
  }
  if (plan_.has_constraints()) project(at, speed);
  set_directions(at, speed);
}

// Coordinates of all joints at (time, y), with the directions of q, qd and balls.
void Tangent::expand(System& system, double time, const double* y, Duals& at, Duals& speed) const {
  const System::Coordinates from = system.coordinates(time, y);
  for (std::size_t i = 0; i < q.size(); ++i) {
    at[i] = Dual(from.q[i], q[i].derivative);
    speed[i] = Dual(from.qd[i], qd[i].derivative);
  }
  for (std::size_t k = 0; k < balls.size(); ++k) {
    const int ball = static_cast<int>(k);
    const Eigen::Map<const Eigen::Vector4d> quaternion(system.layout().quaternion.of(y, ball));
    const Vec3<double> omega(system.layout().omega.of(y, ball));
    put_ball(ball, system.angles_of_ball(ball), turn_of(quaternion, balls[k].quaternion),
             with(omega, balls[k].omega), at, speed);
  }
}

// J dq of the dependent joints is the negative change of the residuals; likewise for velocities and rates.
void Tangent::follow_independent(const Model& model, System& system, double time, const double* y,
                                 const IndependentCoordinates& chosen, const double* dq, const double* dqd) {
  Duals at(q.size()), speed(q.size());
  expand(system, time, y, at, speed);
  chosen.seed(y, dq, dqd, at, speed);
  set_positions(plan_, workspace_, at.data());
  set_ground_motion(plan_, workspace_, speed.data());
  for (std::size_t k = 0; k < plan_.clusters.size(); ++k) {
    const std::vector<int>& dependent = chosen.dependent_joints(k);
    ClusterRows<Dual> rows(model, plan_, workspace_, plan_.clusters[k], FreeJoints::integrated);
    rows.set_pose(at.data());
    rows.measure();
    for (const bool velocity : {false, true}) {
      rows.set_pose(at.data());
      rows.set_motion(speed.data());
      const ClusterRows<Dual>::Rows& violated = velocity ? rows.rates() : rows.residuals();
      Eigen::VectorXd change(violated.size());
      for (Eigen::Index row = 0; row < change.size(); ++row) change[row] = violated[row].derivative;
      const auto count = static_cast<Eigen::Index>(dependent.size());
      change = CompletePivoting(rows.jacobian(dependent), count, IndependentCoordinates::singular, count)
                   .solve(change);
      for (std::size_t i = 0; i < dependent.size(); ++i)
        (velocity ? speed : at)[dependent[i]].derivative -= change[i] * rows.unit(dependent[i]);
    }
  }
  set_directions(at, speed);
}

const std::vector<Dual>& Tangent::row_rates(System& system, double time, const double* y) {
  Duals at(q.size()), speed(q.size());
  expand(system, time, y, at, speed);
  residual_size(at, speed, true);
  return workspace_.loop.rate;
}

// Response of the other joints to a jump of prescribed joints: positions and velocities depend on jumps as
// accelerations depend on prescribed accelerations.
Tangent::Duals Tangent::answer_to(const Duals& jump, const Duals& at) {
  const std::size_t n = at.size();
  Duals rest(n), forces(force.size()), before(n), after(n);
  forward_dynamics(plan_, workspace_, at.data(), rest.data(), forces.data(), before.data());
  for (std::size_t i = 0; i < n; ++i)
    if (plan_.joints[i].prescribed) forces[i] = jump[i];
  forward_dynamics(plan_, workspace_, at.data(), rest.data(), forces.data(), after.data());
  for (std::size_t i = 0; i < n; ++i) after[i] -= before[i];
  return after;
}

// Adds a change of positions or velocities; angular velocities of spherical joints stay constant while their
// angles change.
void Tangent::add(const Duals& change, bool velocity, Duals& at, Duals& speed) const {
  std::vector<Vec3<Dual>> omega;
  for (std::size_t k = 0; k < balls.size(); ++k) omega.push_back(omega_in(at, speed, static_cast<int>(k)));
  for (std::size_t i = 0; i < at.size(); ++i)
    if (!plan_.joints[i].prescribed) (velocity ? speed : at)[i] += change[i];
  for (std::size_t k = 0; k < balls.size() && !velocity; ++k) {
    const Vec3<Dual> rates = angle_rates(angles_in(at, static_cast<int>(k)), omega[k]);
    for (int i = 0; i < 3; ++i) speed[plan_.balls[k] + 1 + i] = rates[i];
  }
}

void Tangent::project(Duals& at, Duals& speed) {
  project_within_rank(at, speed, projection_pivot_tolerance);
  if (relative_violation(workspace_.loop, false) > System::rank_violation)
    project_within_rank(at, speed, dynamics_pivot_tolerance);
}

void Tangent::project_within_rank(Duals& at, Duals& speed, double pivot_tolerance) {
  renew_charts(at, speed);
  Duals unused(at.size());
  workspace_.loop.pivot_tolerance = pivot_tolerance;
  forward_dynamics(plan_, workspace_, at.data(), speed.data(), force.data(), unused.data());
  workspace_.loop.pivot_tolerance = dynamics_pivot_tolerance;
  for (const bool velocity : {false, true}) reduce(at, speed, velocity);
}

// Sets the constraint residuals at these positions and velocities and returns their size.
Tangent::ResidualSize Tangent::residual_size(const Duals& at, const Duals& speed, bool velocity) {
  set_positions(plan_, workspace_, at.data());
  set_ground_motion(plan_, workspace_, speed.data());
  set_constraint_residuals(plan_, workspace_, at.data(), speed.data());
  ResidualSize size{relative_violation(workspace_.loop, velocity), 0};
  for (const Dual& row : velocity ? workspace_.loop.rate : workspace_.loop.residual)
    size.derivative = std::max(size.derivative, std::abs(row.derivative));
  return size;
}

// Newton corrections with one elimination: first of values and derivatives as in System::reduce_residual;
// after convergence of the values, of the derivatives only.
void Tangent::reduce(Duals& at, Duals& speed, bool velocity) {
  LoopState<Dual>& loop = workspace_.loop;
  Duals correction(at.size());
  const Duals& residual = velocity ? loop.rate : loop.residual;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double before = infinity;
  ResidualProgress progress(residual.size());
  progress.restart();
  bool values = true;
  for (int k = 0; k < 3 * System::projection_iterations; ++k) {
    const ResidualSize size = residual_size(at, speed, velocity);
    values =
        values && k < System::projection_iterations && progress.goes_on(loop, velocity, System::rounding);
    const bool converging = size.derivative != 0 && size.derivative < 0.9 * before;
    // the rates of a loop at rest are rounding errors at any scale
    const bool violated = !velocity && size.value > System::rank_violation;
    if (!values && (violated || !converging)) return;
    if (!values) before = size.derivative;
    for (std::size_t row = 0; row < residual.size(); ++row)
      loop.b[row] = Dual(values ? -residual[row].value : 0, -residual[row].derivative);
    correct_loops(plan_, workspace_, correction.data());
    add(correction, velocity, at, speed);
  }
}

const char* Tangent::follow_assembly(const Model& model, const Assembly& assembly) {
  if (assembly.moved.empty()) return "no configuration satisfies the loop constraints";
  // start in the charts of the assembly
  Duals at = q, speed = qd;
  for (std::size_t k = 0; k < balls.size(); ++k) {
    const BallStart<Dual>& start = parameters.balls[k];
    const Eigen::Vector4d quaternion = parts_of(start.quaternion.data()).first.normalized();
    put_ball(static_cast<int>(k), ball_angles(rotation_of(quaternion.data())),
             turn_of(quaternion, balls[k].quaternion), Vec3<Dual>(start.omega.data()), at, speed);
    for (int i = plan_.balls[k] + 1; i < plan_.balls[k] + 4; ++i) {
      at[i].value += assembly.moved[i];
      speed[i].value += assembly.sped[i];
    }
  }
  if (const char* why = redysim::follow_assembly(model, assembly, plan_, workspace_, at, speed)) return why;
  set_directions(at, speed);
  return nullptr;
}

void Tangent::go_with_time(System& system, double time, const double* y) {
  apply_parameters();
  std::vector<double> accelerations(static_cast<std::size_t>(plan_.nv));
  system.accelerations(time, y, accelerations.data());
  for (std::size_t i = 0; i < q.size(); ++i) {
    q[i].derivative = qd[i].value;
    qd[i].derivative = accelerations[i];
  }
  if (actuators_) {
    std::vector<double> slopes(state_.size());
    actuators_->set_slopes(y, slopes.data());
    for (std::size_t i = 0; i < slopes.size(); ++i) state_[i].derivative = slopes[i];
  }
  for (std::size_t i = 0; i < force.size(); ++i)
    force[i].derivative = system.input_slope(static_cast<int>(i));
  with_time_ = true;
  if (control()) control()->go_with_time(system, time, force);
}

Tangent::Misfit Tangent::constraint_misfit(const Model& model) {
  constexpr double rounding = 1e-6;         // relative to the accelerations of both sides
  constexpr double typed_precision = 1e-9;  // m/s^2 or rad/s^2
  const auto change = [](const Vec3<Dual>& of) {
    return std::hypot(of[0].derivative, of[1].derivative, of[2].derivative);
  };
  const auto value = [](const Vec3<Dual>& of) { return std::hypot(of[0].value, of[1].value, of[2].value); };
  Misfit worst;
  set_positions(plan_, workspace_, q.data());
  set_ground_motion(plan_, workspace_, qd.data());
  for (const LoopPlan<Dual>& loop : plan_.loops) {
    const LoopGeometry<Dual> g = loop_geometry(loop, workspace_);
    double distance = 0, angle = 0;
    for (const ConstraintRow<Dual>& row : loop.rows) {
      double& sum = row.kind == ConstraintRow<Dual>::Kind::rotation ? angle : distance;
      sum = std::hypot(sum, row_values(g, row).rate.derivative);
    }
    double linear = 0, angular = 0;
    for (const auto& [body, point] : {std::pair(&g.a, &g.point_a), std::pair(&g.b, &g.point_b)}) {
      const double turns = change(body->omega) + value(body->omega) * value(body->omega);
      angular += turns;
      linear += change(body->velocity) + turns * value(point->arm);
    }
    if (distance <= rounding * linear + typed_precision) distance = 0;
    if (angle <= rounding * angular + typed_precision) angle = 0;
    if (std::max(distance, angle) > worst.acceleration.size)
      worst = {loop.loop, {std::max(distance, angle), angle > distance}};
  }
  for (const CouplingPlan& coupling : plan_.couplings) {
    double sum = 0, size = 0;
    for (std::size_t k = 0; k < coupling.joints.size(); ++k) {
      const double part = coupling.ratios[k] * qd[static_cast<std::size_t>(coupling.joints[k])].derivative;
      sum += part;
      size = std::max(size, std::abs(part));
    }
    if (std::abs(sum) > std::max(rounding * size + typed_precision, worst.acceleration.size))
      worst = {coupling_constraint(model, coupling.coupling),
               {std::abs(sum), turns(plan_.joints[coupling.joints.front()])}};
  }
  return worst;
}

// Sets the angles, rates and forces of the joints that represent a spherical one.
void Tangent::set_balls() {
  for (std::size_t k = 0; k < balls.size(); ++k) {
    const int first = plan_.balls[k] + 1;
    const BallAngles& a = angles_[k];
    if (!with_time_) {
      const Vec3<double> change = angle_rates(a, turn_of(ball_quaternion_[k], balls[k].quaternion));
      for (int i = 0; i < 3; ++i) q[first + i].derivative += change[i];
    }
    const Vec3<double> change(q[first].derivative, q[first + 1].derivative, q[first + 2].derivative);
    ball_turn_[k] = rate_matrix(a) * change;
    moved_[k] = {a.turned, Dual(a.phi, change[0]), Dual(a.theta, change[1]), Dual(a.psi, change[2])};
    const Vec3<Dual> rates = angle_rates(moved_[k], with(ball_omega_[k], balls[k].omega));
    const Vec3<Dual> torque(inputs_.ball_torque.of(force.data(), static_cast<int>(k)));
    const Vec3<Dual> forces = rate_matrix(moved_[k]).transpose() * torque;
    for (int i = 0; i < 3; ++i) {
      if (!with_time_) qd[first + i].derivative += rates[i].derivative;
      force[first + i] = forces[i];
    }
  }
}

void Tangent::start_actuators() {
  for (int k = 0; k < actuator_count(); ++k) {
    const Actuators::Places place = actuators_->places(k);
    if (place.motor_q < 0) continue;
    const double ratio = actuators_->law(k).gear_ratio;
    state_[place.motor_q].derivative = ratio * q[actuators_->joint(k)].derivative;
    state_[place.motor_qd].derivative = ratio * qd[actuators_->joint(k)].derivative;
  }
}

// Replaces actuator inputs by torques on the joints.
void Tangent::apply_actuators() {
  for (int k = 0; k < actuator_count(); ++k) {
    const int joint = actuators_->joint(k);
    actuator_inputs_[k] = force[joint];
    responses_[k] =
        respond(actuator_law(k), actuators_->point(k, state_.data(), q[joint], qd[joint], force[joint]));
    force[joint] = responses_[k].torque;
  }
}

bool Tangent::evaluate() {
  set_balls();
  if (control()) control()->answer(q, qd, force);
  apply_actuators();
  const std::size_t n = q.size();
  forward_dynamics(plan_, workspace_, q.data(), qd.data(), force.data(), qdd.data());
  multipliers = workspace_.loop.lambda;
  for (std::size_t i = 0; i < n; ++i)
    drive[i] = plan_.joints[i].prescribed
                   ? prescribed_force(plan_, workspace_, static_cast<int>(i), q.data(), qd.data(), qdd.data())
                   : force[i];
  power = external_power(plan_, workspace_, q.data(), qd.data(), drive.data());
  for (int k = 0; k < inputs_.port_wrench.count; ++k) power += port_power(k);
  for (const ActuatorResponse<Dual>& response : responses_) power += response.power;
  if (sensed_)
    sensed_->evaluate(q.data(), qd.data(), qdd.data(), inputs_.port_wrench.of(force.data()), multipliers);
  if (terms_)
    terms_->go_to(q.data(), qd.data(), qdd.data(), inputs_.port_wrench.of(force.data()), multipliers);
  double sum = 0;
  for (const Dual& a : qdd) sum += a.value * 0.0 + a.derivative * 0.0;
  for (const Dual& a : drive) sum += a.derivative * 0.0;
  return sum == 0;
}

Dual Tangent::port_power(int port) const {
  return redysim::port_power(plan_, workspace_, plan_.ports[port], qd.data(),
                             inputs_.port_wrench.of(force.data(), port));
}

Eigen::Vector4d Tangent::quaternion_slope(int ball) const {
  Eigen::Vector4d by_quaternion, by_omega;
  quaternion_rate(balls[ball].quaternion, ball_omega_[ball].data(), by_quaternion.data());
  quaternion_rate(ball_quaternion_[ball].data(), balls[ball].omega, by_omega.data());
  return by_quaternion + by_omega;
}

Dual Tangent::kinetic_energy() {
  Dual energy = redysim::kinetic_energy(plan_, workspace_, q.data(), qd.data());
  for (int k = 0; k < actuator_count(); ++k) energy += actuators_->kinetic_energy(k, state_.data());
  return energy;
}

Dual Tangent::potential_energy() {
  Dual energy = redysim::potential_energy(plan_, workspace_, q.data(), qd.data());
  for (int k = 0; k < actuator_count(); ++k)
    energy += actuators_->potential_energy(k, actuator_law(k), state_.data(), q[actuators_->joint(k)]);
  return energy;
}

Force<Dual> Tangent::momentum() { return redysim::momentum(plan_, workspace_, q.data(), qd.data()); }

AcceleratedBody<Dual> Tangent::body(int index) {
  set_positions(plan_, workspace_, q.data());
  return body_motion(plan_, workspace_, index, qd.data(), qdd.data());
}

Tangent::BallMotion Tangent::ball(int index) const {
  const int first = plan_.balls[index] + 1;
  const Vec3<Dual> rates(qd[first], qd[first + 1], qd[first + 2]);
  const Vec3<Dual> accelerations(qdd[first], qdd[first + 1], qdd[first + 2]);
  const Mat3<Dual> E = rate_matrix(moved_[index]);
  return {E * rates, E * accelerations + rate_bias(moved_[index], rates), ball_turn_[index]};
}

}  // namespace redysim
