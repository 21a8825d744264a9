#include "model/inertia.hpp"

#include <Eigen/Eigenvalues>

namespace redysim {

Mat3<double> inertia_matrix(const std::array<double, 6>& inertia) {
  const auto& [xx, yy, zz, xy, xz, yz] = inertia;
  Mat3<double> matrix;
  matrix << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return matrix;
}

Vec3<double> principal_moments(const std::array<double, 6>& inertia) {
  return Eigen::SelfAdjointEigenSolver<Mat3<double>>(inertia_matrix(inertia), Eigen::EigenvaluesOnly)
      .eigenvalues();
}

bool has_negative_moment(const Vec3<double>& moments) {
  return moments[0] < -1e-12 * moments.cwiseAbs().maxCoeff();
}

}  // namespace redysim
