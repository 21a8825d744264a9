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

  template <class Other>
  Parameters<Other> cast() const {
    if constexpr (std::is_same_v<Other, Scalar>)
      return *this;
    else
      return {gravity.template cast<Other>(), cast_each<Other>(links),
              cast_each<Other>(joints),       cast_each<Other>(controlled),
              cast_each<Other>(balls),        cast_each<Other>(contacts),
              cast_each<Other>(actuators),    solver};
  }
};

// The values of the model file.
Parameters<double> parameters_of(const Model& model);

}  // namespace redysim
