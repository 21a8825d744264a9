#pragma once

#include <array>

#include "math/vec3.hpp"

namespace redysim {

// Matrix of (Ixx, Iyy, Izz, Ixy, Ixz, Iyz).
Mat3<double> inertia_matrix(const std::array<double, 6>& inertia);

// Eigenvalues of the matrix, in increasing order.
Vec3<double> principal_moments(const std::array<double, 6>& inertia);

// Whether a principal moment is negative by more than rounding.
bool has_negative_moment(const Vec3<double>& moments);

}  // namespace redysim
