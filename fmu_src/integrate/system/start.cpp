#include "integrate/system/start.hpp"

#include <algorithm>

#include "dynamics/assembly/freedom.hpp"
#include "model/motion_scale.hpp"

namespace redysim {

std::array<double, 3> start_motion(const Joint& joint, const JointParameters<double>& start) {
  return {start.q0, joint.drive == Drive::motion ? start.qd0 : 0, 0};
}

void begin_motions(const Model& model, System& system, double time) {
  const Plan<double>& plan = system.plan();
  system.enter_phases(time);
  for (int i = 0; i < plan.nv; ++i) {
    if (!plan.joints[i].prescribed) continue;
    const Joint& joint = model.links[plan.joints[i].link].joint;
    const auto [q, qd, qdd] = start_motion(joint, joint);
    system.set_motion(time, i, q, qd, qdd);
  }
}

void normalise_quaternions(const StateLayout& layout, double* y) {
  for (int ball = 0; ball < layout.quaternion.count; ++ball)
    Eigen::Map<Eigen::Vector4d>(layout.quaternion.of(y, ball)).normalize();
}

void set_start_values(const Parameters<double>& parameters, const System& system, double* y) {
  const Plan<double>& plan = system.plan();
  const StateLayout& layout = system.layout();
  for (int i = 0; i < system.simple(); ++i) {
    const JointParameters<double>& joint = parameters.joints[plan.joints[system.joint_of(i)].link];
    y[i] = joint.q0;
    y[layout.qd[i]] = joint.qd0;
  }
  for (int ball = 0; ball < system.balls(); ++ball) {
    const BallStart<double>& start = parameters.balls[ball];
    std::copy_n(start.quaternion.begin(), 4, layout.quaternion.of(y, ball));
    std::copy_n(start.omega.begin(), 3, layout.omega.of(y, ball));
  }
  normalise_quaternions(layout, y);
  if (system.actuators()) system.actuators()->set_start(y);
  std::fill_n(layout.work.of(y), layout.work.count, 0.0);
}

Start assemble_start(const Model& model, const Parameters<double>& parameters, System& system, double time,
                     double* y) {
  const Plan<double>& plan = system.plan();
  Start start;
  set_start_values(parameters, system, y);
  if (system.has_constraints()) {
    const System::Coordinates at = system.coordinates(time, y);
    std::vector<double> q(at.q, at.q + plan.nv), qd(at.qd, at.qd + plan.nv);
    start.assembly = assemble(model, plan, system.workspace(), q.data(), qd.data());
    if (!start.assembly.moved.empty()) system.collect(q.data(), qd.data(), y);
    if (system.actuators()) system.actuators()->set_start(y);
  }
  if (model.starts_in_equilibrium && start.assembly.closed) {
    std::vector<double> scales;
    for (int k = 0; k < system.simple(); ++k)
      scales.push_back(search_scale(model, parameters, plan.joints[system.joint_of(k)].link));
    system.set_scales(model, parameters);
    start.rest = find_rest(system, scales, time, y);
  }
  return start;
}

Tangent::Misfit misfit_of_accelerations(const Model& model, const Parameters<double>& parameters,
                                        System& system, double time, const double* y) {
  const Plan<double>& plan = system.plan();
  if (!plan.has_constraints() || plan.prescribed_count == static_cast<int>(plan.balls.size())) return {};
  if (freedom(model, plan, system.coordinates(time, y).q).surplus == 0) return {};
  Tangent tangent(model, system);
  tangent.go_to(parameters, system, time, y);
  tangent.go_with_time(system, time, y);
  return tangent.constraint_misfit(model);
}

Model at_start(const Model& model, System& system, double time, const double* y) {
  Model result = model;
  const System::Coordinates at = system.coordinates(time, y);
  for (int i = 0; i < system.plan().nv; ++i) {
    const auto& joint = system.plan().joints[i];
    if (joint.of_ball) continue;
    result.links[joint.link].joint.q0 = at.q[i];
    result.links[joint.link].joint.qd0 = at.qd[i];
  }
  for (int ball = 0; ball < system.balls(); ++ball) {
    std::copy_n(system.layout().quaternion.of(y, ball), 4, result.balls[ball].quaternion.begin());
    std::copy_n(system.layout().omega.of(y, ball), 3, result.balls[ball].omega.begin());
  }
  return result;
}

}  // namespace redysim
