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

// A state that a master gives (tunable "state"); empty: none can be given. Positions and velocities of the
// tree in the order of its joints, a spherical joint as quaternion and angular velocity, then the states of
// actuators.
struct StateToApply {
  std::vector<double> q, qd, actuator;
  double number = 0;  // when it changes, the state is applied
};

// The numbers of a model that a master may set. On dual numbers each of them carries its derivative along one
// direction, and so does all that is computed from them.
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
  StateToApply state;  // without derivatives

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
