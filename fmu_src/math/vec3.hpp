#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace redysim {

// Fixed-size vectors and matrices are Eigen's; the structured spatial types are in spatial.hpp.
template <class Scalar>
using Vec3 = Eigen::Matrix<Scalar, 3, 1>;
template <class Scalar>
using Mat3 = Eigen::Matrix<Scalar, 3, 3>;

}  // namespace redysim
