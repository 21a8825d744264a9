#pragma once

#include <vector>

namespace redysim {

// Torques of joints from a reference (the joint's trajectory, or its target) and gains; e = reference - q:
//   pd                    tau = kp e + kd e'
//   gravity_compensation  ... + the torque that holds the pose against gravity and springs
//   feed_forward          ... + the inverse dynamics of the reference
//   computed_torque       the tau at which qdd = qdd_reference + kd e' + kp e
enum class Law { none, pd, gravity_compensation, feed_forward, computed_torque };

template <class Scalar>
struct ControlledJointOf {
  int link = 0;           // the joint of this link
  Scalar kp = 0, kd = 0;  // N m/rad and N m s/rad (N/m, N s/m); computed torque: 1/s^2 and 1/s
  Scalar target = 0;      // rad or m; for a joint without trajectory

  template <class Other>
  ControlledJointOf<Other> cast() const {
    return {link, kp, kd, target};
  }
};
using ControlledJoint = ControlledJointOf<double>;

struct Controller {
  Law law = Law::none;
  bool input = false;  // an additional torque can be set: <joint>.tau_added
  // s. sample_time 0: the law acts continuously; otherwise its torques act `delay` after the sample.
  double sample_time = 0, delay = 0;
  std::vector<ControlledJoint> joints;
};

}  // namespace redysim
