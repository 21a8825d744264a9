#pragma once

#include <algorithm>
#include <type_traits>
#include <utility>

#include "dynamics/aba.hpp"
#include "dynamics/compiled.hpp"
#include "dynamics/rnea.hpp"
#include "model/model.hpp"

namespace redysim {

// The controller's model of the plant: controlled joints are prescribed. For gravity compensation it has no
// contacts and stops, since a torque that cancels their forces would push through them.
Model known_plant(Model model);

// The part of a control law that uses a model of the plant, on any scalar. Does not allocate after
// construction.
template <class Scalar>
struct InternalModel {
  Law law;
  Plan<Scalar> plan;  // controlled joints are prescribed
  Workspace<Scalar> workspace;
  std::vector<Scalar> inputs, q, qd, qdd, zero;
  std::vector<Scalar> torques;  // work space of the caller

  InternalModel(Law of_control, Plan<Scalar> of)
      : law(of_control),
        plan(std::move(of)),
        workspace(plan),
        inputs(static_cast<std::size_t>(InputLayout(plan).recursion_size()), Scalar(0)),
        q(static_cast<std::size_t>(plan.nv), Scalar(0)),
        qd(q),
        qdd(q),
        zero(q),
        torques(q) {
    forget_stops();
  }

  void update(const Parameters<Scalar>& parameters) {
    plan.update(parameters);
    forget_stops();
  }

  // Sets `result` (nv) to the torques of the law at (q, qd), without PD control. `reference(k)` and
  // `gains[k]` belong to the controlled joint `joints[k]`; `given`: inputs of the other joints.
  template <class References, class Gains>
  void evaluate(const std::vector<int>& joints, const References& reference, const Gains& gains,
                const Scalar* at_q, const Scalar* at_qd, const Scalar* given, Scalar* result) {
    switch (law) {
      case Law::gravity_compensation:
        return gravity_compensation(joints, at_q, result);
      case Law::feed_forward:
        return feed_forward(joints, reference, at_q, at_qd, given, result);
      default:
        return computed_torque(joints, reference, gains, at_q, at_qd, given, result);
    }
  }

 private:
  [[gnu::cold, gnu::noinline]] void forget_stops() {
    if (law == Law::gravity_compensation)
      for (auto& joint : plan.joints) joint.has_stops = false;
  }

  // Torques that keep the controlled joints at rest.
  void gravity_compensation(const std::vector<int>& joints, const Scalar* at_q, Scalar* result) {
    if (!plan.has_constraints()) return inverse(at_q, zero.data(), zero.data(), result);
    std::fill(inputs.begin(), inputs.end(), Scalar(0));
    forces_of_motion(joints, at_q, zero.data(), result);
  }

  // Torques along the reference; requires that all joints are controlled or prescribed.
  template <class References>
  void feed_forward(const std::vector<int>& joints, const References& reference, const Scalar* at_q,
                    const Scalar* at_qd, const Scalar* given, Scalar* result) {
    std::copy_n(at_q, q.size(), q.begin());
    std::copy_n(at_qd, q.size(), qd.begin());
    std::copy_n(given, q.size(), qdd.begin());
    for (std::size_t k = 0; k < joints.size(); ++k) {
      const auto wanted = reference(k);
      q[joints[k]] = wanted.q;
      qd[joints[k]] = wanted.qd;
      qdd[joints[k]] = wanted.qdd;
    }
    inverse(q.data(), qd.data(), qdd.data(), result);
  }

  // Torques for qdd = qdd_reference + kd e' + kp e. The law includes the drives of the other joints, but not
  // the forces at ports.
  template <class References, class Gains>
  void computed_torque(const std::vector<int>& joints, const References& reference, const Gains& gains,
                       const Scalar* at_q, const Scalar* at_qd, const Scalar* given, Scalar* result) {
    std::copy_n(given, q.size(), inputs.begin());
    for (std::size_t k = 0; k < joints.size(); ++k) {
      const int i = joints[k];
      const auto wanted = reference(k);
      inputs[i] = wanted.qdd + gains[k].kd * (wanted.qd - at_qd[i]) + gains[k].kp * (wanted.q - at_q[i]);
    }
    forces_of_motion(joints, at_q, at_qd, result);
  }

  // Torques of the controlled joints for the accelerations in `inputs`.
  void forces_of_motion(const std::vector<int>& joints, const Scalar* at_q, const Scalar* at_qd,
                        Scalar* result) {
    if constexpr (std::is_same_v<Scalar, double>) {
      compiled_forward_dynamics(plan, workspace, at_q, at_qd, inputs.data(), qdd.data());
      for (int i : joints)
        result[i] = compiled_prescribed_force(plan, workspace, i, at_q, at_qd, inputs.data());
    } else {
      forward_dynamics(plan, workspace, at_q, at_qd, inputs.data(), qdd.data());
      for (int i : joints) result[i] = prescribed_force(plan, workspace, i, at_q, at_qd, inputs.data());
    }
  }

  void inverse(const Scalar* at_q, const Scalar* at_qd, const Scalar* at_qdd, Scalar* result) {
    if constexpr (std::is_same_v<Scalar, double>)
      compiled_inverse_dynamics(plan, workspace, at_q, at_qd, at_qdd, result);
    else
      inverse_dynamics(plan, workspace, at_q, at_qd, at_qdd, result);
  }
};

}  // namespace redysim
