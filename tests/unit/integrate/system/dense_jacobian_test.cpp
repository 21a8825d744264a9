#include "integrate/system/dense_jacobian.hpp"

#include <gtest/gtest.h>

#include "support/random_tree.hpp"
#include "unit/integrate/rig.hpp"

namespace redysim {
namespace {

using test::Rig;
using test::solver;

// The system's Jacobian near a state, against central differences; `far`: of the random changes of the state.
void expect_exact(System& system, std::vector<double> y, unsigned seed, double far) {
  test::Random random(seed);
  const int size = system.size();
  for (double& value : y) value += random.between(-far, far);
  for (int i = 0; i < system.plan().nv; ++i) system.tau(i) = random.between(-1, 1);
  for (int ball = 0; ball < system.balls(); ++ball)
    for (int k = 0; k < 3; ++k) system.ball_torque(ball)[k] = random.between(-1, 1);
  std::vector<double> matrix(static_cast<std::size_t>(size * size)), above(y), below(y), up(y), down(y);
  DenseJacobian jacobian(system);
  ASSERT_EQ(jacobian.evaluate(0, y.data(), matrix.data()), Status::ok);
  const double h = 1e-4 * far;
  // nothing depends on the part of contacts in the work: its row is empty
  const int rows = size - (system.layout().work.count > 1 ? 1 : 0);
  for (int j = 0; j < size; ++j) {
    above[j] = y[j] + h;
    below[j] = y[j] - h;
    ASSERT_EQ(system.right_hand_side(0, above.data(), up.data()), Status::ok);
    ASSERT_EQ(system.right_hand_side(0, below.data(), down.data()), Status::ok);
    // the differences lose the digits of the slopes themselves
    double scale = 1;
    for (int i = 0; i < rows; ++i)
      scale = std::max({scale, std::fabs(matrix[j * size + i]), 1e-2 * std::fabs(up[i])});
    for (int i = 0; i < rows; ++i)
      EXPECT_NEAR(matrix[j * size + i], (up[i] - down[i]) / (2 * h), 2e-6 * scale)
          << "row " << i << " column " << j;
    above[j] = below[j] = y[j];
  }
}

// The model's, near its start pose, with work; a small change, so that loops need not be closed again to be
// at full rank.
void expect_exact(const std::string& name, unsigned seed, double far = 0.05) {
  SCOPED_TRACE(name);
  Rig rig(name, solver(SolverMethod::erk), true);
  expect_exact(rig.system, rig.start_state(), seed, far);
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

// Fingers of a hand on a slide: the slide moves both bodies of their contact, and one of that with the floor.
constexpr const char* hand = R"(
name = "hand"
[[link]]
name = "palm"
joint = "prismatic"
mass = 1
[[link]]
name = "left"
parent = "palm"
alpha = 1.5707963267948966
mass = 0.3
com = [0.1, 0, 0]
inertia = [0.001, 0.002, 0.003]
q = -0.3
[[link]]
name = "right"
parent = "palm"
a = 0.35
alpha = 1.5707963267948966
mass = 0.4
com = [0.1, 0, 0]
inertia = [0.001, 0.002, 0.003]
q = -2.8415926535897932
[[contact]]
name = "pinch"
link_a = "left"
shape_a = "sphere"
point_a = [0.2, 0, 0]
radius_a = 0.05
link_b = "right"
shape_b = "sphere"
point_b = [0.2, 0, 0]
radius_b = 0.05
stiffness = 1e4
damping = 2
friction = 0.5
friction_velocity = 0.1
[[contact]]
name = "floor"
link_a = "left"
shape_a = "sphere"
point_a = [0.2, 0, 0]
radius_a = 0.05
point_b = [0, 0, -0.1]
stiffness = 1e4
damping = 2
friction = 0.5
friction_velocity = 0.1
)";

TEST(DenseJacobian, knows_contacts) {
  for (const char* name : {"quadruped", "parallel_gripper", "newtons_cradle"}) expect_exact(name, 5, 1e-3);
  const Model model = read_model_text(hand, "hand.toml").model;
  const Plan<double> plan(model);
  System system(plan, true, &model);
  std::vector<double> y(static_cast<std::size_t>(system.size()), 0.0);
  set_start_values(parameters_of(model), system, y.data());
  for (unsigned seed : {1u, 2u, 3u}) expect_exact(system, y, seed, 1e-2);
}

}  // namespace
}  // namespace redysim
