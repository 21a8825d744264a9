#include "math/rotation_vector.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "math/dual.hpp"

namespace redysim {
namespace {

const Vec3<double> axis = Vec3<double>(0.3, -0.7, 0.5).normalized();

Mat3<double> turn(double angle) { return Mat3<double>(Eigen::AngleAxisd(angle, axis)); }

constexpr double angles[] = {0,    1e-300, 1e-12, 1e-6, 1e-3, 0.19, 0.1994, 0.2,
                             0.21, 0.5,    1.5,   1.57, 1.58, 2.5,  3,      3.14159};

TEST(rotation_vector, is_the_axis_times_the_angle) {
  for (double angle : angles)
    for (double sign : {1.0, -1.0}) {
      const Vec3<double> phi = RotationVector<double>(turn(sign * angle)).value();
      EXPECT_LE((phi - sign * angle * axis).norm(), 4e-15 * std::max(1.0, angle)) << angle;
    }
}

TEST(rotation_vector, is_exact_at_half_a_turn) {
  for (int k = 0; k < 3; ++k) {
    Mat3<double> R = -Mat3<double>::Identity();
    R(k, k) = 1;
    const Vec3<double> phi = RotationVector<double>(R).value();
    EXPECT_NEAR(std::abs(phi[k]), 3.14159265358979324, 1e-15);
    EXPECT_NEAR(phi.norm(), 3.14159265358979324, 1e-15);
  }
}

// Power of a moment: gradient . phi' for any angular velocity of R, phi' by dual numbers.
TEST(rotation_vector, its_moment_has_the_power_of_the_gradient) {
  const Vec3<double> gradient(0.4, 1.3, -0.8);
  for (double angle : angles) {
    const Mat3<double> R = turn(angle);
    const Vec3<double> moment = RotationVector<double>(R).moment(gradient);
    for (int k = 0; k < 3; ++k) {
      Mat3<Dual> moving;
      for (int column = 0; column < 3; ++column) {
        const Vec3<double> at = R.col(column), rate = Vec3<double>::Unit(k).cross(at);
        for (int row = 0; row < 3; ++row) moving(row, column) = Dual(at[row], rate[row]);
      }
      const Vec3<Dual> phi = RotationVector<Dual>(moving).value();
      double power = 0;
      for (int i = 0; i < 3; ++i) power += gradient[i] * phi[i].derivative;
      EXPECT_NEAR(moment[k], power, 1e-13) << angle;
    }
  }
}

}  // namespace
}  // namespace redysim
