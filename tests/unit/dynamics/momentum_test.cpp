#include "dynamics/momentum.hpp"

#include <gtest/gtest.h>

#include "unit/dynamics/planar_arm.hpp"

namespace redysim {
namespace {

TEST(Momentum, of_two_rods) {
  const test::PlanarArm arm;
  const test::Vector &q = test::arm_q, &qd = test::arm_qd;
  test::Evaluate<double> evaluate(arm.model);
  const Force<double> found = momentum(evaluate.plan, evaluate.ws, q.data(), qd.data());

  const double sum = q[0] + q[1], rate = qd[0] + qd[1];
  const Vec3<double> along1(std::cos(q[0]), std::sin(q[0]), 0), across1(-along1.y(), along1.x(), 0);
  const Vec3<double> along2(std::cos(sum), std::sin(sum), 0), across2(-along2.y(), along2.x(), 0);
  const Vec3<double> v1 = arm.l1 / 2 * qd[0] * across1,
                     v2 = arm.l1 * qd[0] * across1 + arm.l2 / 2 * rate * across2;
  const Vec3<double> c2 = arm.l1 * along1 + arm.l2 / 2 * along2;
  const double spin2 = arm.model.links[1].inertia[2] * rate;
  EXPECT_LT((found.force - (arm.m1 * v1 + arm.m2 * v2)).norm(), 1e-14);
  EXPECT_NEAR(found.moment.z(), arm.i1 * qd[0] + arm.m2 * c2.cross(v2).z() + spin2, 1e-14);
  EXPECT_NEAR(found.moment.head<2>().norm(), 0, 1e-14);
}

}  // namespace
}  // namespace redysim
