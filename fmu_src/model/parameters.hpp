#pragma once

#include <type_traits>
#include <vector>

#include "model/model.hpp"

namespace redysim {

template <class Scalar, class Part>
auto cast_each(const std::vector<Part>& parts) {
  std::vector<decltype(parts[0].template cast<Scalar>())> result;
  result.reserve(parts.size());
  for (const Part& part : parts) result.push_back(part.template cast<Scalar>());
  return result;
}

// A state that a master sets (tunable "state"); empty if this is not enabled. Positions and velocities are
// in joint order, with quaternion and angular velocity for a spherical joint; then the actuator states.
struct StateToApply {
  std::vector<double> q, qd, actuator;
  double number = 0;  // the state is applied when this number changes
};

// The values of a model that a master may set. With dual numbers each value carries its derivative in one
// direction, and so do all results computed from it.
template <class Scalar>
struct Parameters {
  Vec3<Scalar> gravity;
  std::vector<LinkParameters<Scalar>> links;
  std::vector<JointParameters<Scalar>> joints;  // per link
  std::vector<ControlledJointOf<Scalar>> controlled;
  std::vector<BallStart<Scalar>> balls;
  std::vector<ContactParameters<Scalar>> contacts;
  std::vector<ActuatorOf<Scalar>> actuators;
  SolverSettings solver;
  StateToApply state;  // always without derivatives

  template <class Other>
  Parameters<Other> cast() const {
    if constexpr (std::is_same_v<Other, Scalar>)
      return *this;
    else
      return {gravity.template cast<Other>(),
              cast_each<Other>(links),
              cast_each<Other>(joints),
              cast_each<Other>(controlled),
              cast_each<Other>(balls),
              cast_each<Other>(contacts),
              cast_each<Other>(actuators),
              solver,
              {}};
  }
};

// The values of the model file.
Parameters<double> parameters_of(const Model& model);

}  // namespace redysim
