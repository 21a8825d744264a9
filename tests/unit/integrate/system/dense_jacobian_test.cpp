#include "integrate/system/dense_jacobian.hpp"

#include <gtest/gtest.h>

#include "support/random_tree.hpp"
#include "unit/integrate/rig.hpp"

namespace redysim {
namespace {

using test::Rig;
using test::solver;

// The model's Jacobian near its start pose, with and without work, against central differences.
void expect_exact(const std::string& name, unsigned seed) {
  SCOPED_TRACE(name);
  test::Random random(seed);
  Rig rig(name, solver(SolverMethod::erk), true);
  System& system = rig.system;
  const int size = system.size();
  std::vector<double> y = rig.start_state();
  // small, so that loops need not be closed again to be at full rank
  for (double& value : y) value += random.between(-0.05, 0.05);
  for (int i = 0; i < system.plan().nv; ++i) system.tau(i) = random.between(-1, 1);
  for (int ball = 0; ball < system.balls(); ++ball)
    for (int k = 0; k < 3; ++k) system.ball_torque(ball)[k] = random.between(-1, 1);
  std::vector<double> matrix(static_cast<std::size_t>(size * size)), above(y), below(y), up(y), down(y);
  DenseJacobian jacobian(system);
  ASSERT_EQ(jacobian.evaluate(0, y.data(), matrix.data()), Status::ok);
  constexpr double h = 1e-6;
  for (int j = 0; j < size; ++j) {
    above[j] = y[j] + h;
    below[j] = y[j] - h;
    ASSERT_EQ(system.right_hand_side(0, above.data(), up.data()), Status::ok);
    ASSERT_EQ(system.right_hand_side(0, below.data(), down.data()), Status::ok);
    // the differences lose the digits of the slopes themselves
    double scale = 1;
    for (int i = 0; i < size; ++i)
      scale = std::max({scale, std::fabs(matrix[j * size + i]), 1e-2 * std::fabs(up[i])});
    for (int i = 0; i < size; ++i)
      EXPECT_NEAR(matrix[j * size + i], (up[i] - down[i]) / (2 * h), 2e-6 * scale)
          << "row " << i << " column " << j;
    above[j] = below[j] = y[j];
  }
}

TEST(DenseJacobian, is_the_derivative_of_the_right_hand_side) {
  for (const char* name :
       {"pendulum", "double_pendulum", "kuka_kr5", "scara", "gripper", "four_bar", "long_chain"})
    expect_exact(name, 3);
}

TEST(DenseJacobian, knows_spherical_joints) {
  for (const char* name : {"top", "space_robot"})
    for (unsigned seed : {1u, 2u, 3u}) expect_exact(name, seed);
}

}  // namespace
}  // namespace redysim
