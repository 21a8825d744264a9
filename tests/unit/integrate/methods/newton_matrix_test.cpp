#include "integrate/methods/newton_matrix.hpp"

#include <gtest/gtest.h>

#include "integrate/system/dense_jacobian.hpp"
#include "support/dense.hpp"
#include "unit/integrate/rig.hpp"

namespace redysim {
namespace {

// Two joints, a spherical joint and a work state: q 0, 1; quaternion 2 to 5; qd 6, 7; omega 8 to 10; work 11.
Eigen::MatrixXd random_matrix(const StateLayout& layout, double gamma) {
  std::srand(3);
  const int size = layout.size();
  Eigen::MatrixXd J = Eigen::MatrixXd::Random(size, size);
  for (int k = 0; k < layout.q.count; ++k) {
    J.row(layout.q[k]).setZero();
    J(layout.q[k], layout.qd[k]) = 1;
  }
  if (layout.work.count > 0) J.col(layout.work.begin).setZero();
  return Eigen::MatrixXd::Identity(size, size) - gamma * J;
}

std::vector<double*> columns_of(Eigen::MatrixXd& matrix) {
  std::vector<double*> columns;
  for (int k = 0; k < matrix.cols(); ++k) columns.push_back(matrix.col(k).data());
  return columns;
}

TEST(NewtonMatrix, solves_like_the_factor_of_the_whole_matrix) {
  for (const int joints : {0, 1, 2, 7}) {
    const StateLayout layout(joints, 1, 1);
    for (const double gamma : {1e-6, 0.3, 1e4}) {
      const Eigen::MatrixXd whole = random_matrix(layout, gamma);
      const Eigen::VectorXd b = Eigen::VectorXd::Random(layout.size());
      Eigen::MatrixXd matrix = whole;
      std::vector<double*> columns = columns_of(matrix);
      NewtonMatrix newton(layout);
      ASSERT_TRUE(newton.factor(columns.data()));
      Eigen::VectorXd x = b;
      newton.solve(columns.data(), x.data());
      const Eigen::VectorXd expected = test::solve(whole, b);
      EXPECT_LT((x - expected).norm(), 1e-10 * expected.norm()) << joints << " joints, gamma " << gamma;
    }
  }
}

TEST(NewtonMatrix, solves_the_motion_with_equal_rounding_with_and_without_work) {
  const StateLayout without(2, 1, 0), with(2, 1, 1);
  Eigen::MatrixXd larger = random_matrix(with, 0.3);
  larger.row(with.work.begin).head(without.size()) *= 1e6;
  Eigen::MatrixXd smaller = larger.topLeftCorner(without.size(), without.size());
  const Eigen::VectorXd b = Eigen::VectorXd::Random(with.size());
  const auto solved = [&b](Eigen::MatrixXd& matrix, const StateLayout& layout) {
    std::vector<double*> columns = columns_of(matrix);
    NewtonMatrix newton(layout);
    EXPECT_TRUE(newton.factor(columns.data()));
    Eigen::VectorXd x = b.head(layout.size());
    newton.solve(columns.data(), x.data());
    return x;
  };
  EXPECT_EQ(solved(larger, with).head(without.size()), solved(smaller, without));
}

void put(const Eigen::Quaterniond& orientation, double* q) {
  q[0] = orientation.w();
  Eigen::Map<Vec3<double>>(q + 1) = orientation.vec();
}

// I - gamma J of the system at y, and its state.
struct At {
  std::vector<double> y;
  Eigen::MatrixXd matrix;

  At(System& system, std::vector<double> state, double gamma) : y(std::move(state)) {
    const int size = system.size();
    matrix.resize(size, size);
    EXPECT_EQ(DenseJacobian(system).evaluate(0, y.data(), matrix.data()), Status::ok);
    matrix = Eigen::MatrixXd::Identity(size, size) - gamma * matrix;
  }
};

// It slides and spins on the floor.
TEST(NewtonMatrix, of_a_sphere_that_has_turned_is_that_of_its_new_orientation) {
  test::Rig rig("rolling_ball", test::solver(SolverMethod::bdf), false);
  const StateLayout& layout = rig.system.layout();
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.7, -0.4, 0.3, 0.9).normalized(),
                           start = Eigen::Quaterniond(0.2, 0.5, -0.8, 0.1).normalized();
  const Vec3<double> spin(3, 20, -1);
  std::vector<double> before = rig.start_state();
  before[layout.q[2]] = 0.0995;
  std::vector<double> after = before;
  for (auto [y, orientation] : {std::pair(&before, start), std::pair(&after, turn * start)}) {
    put(orientation, layout.quaternion.of(y->data(), 0));
    Eigen::Map<Vec3<double>>(layout.omega.of(y->data(), 0)) = orientation.conjugate() * spin;
  }
  const double gamma = 1e-3;
  At old(rig.system, before, gamma);
  const At present(rig.system, after, gamma);
  ASSERT_GT((old.matrix - present.matrix).norm(), 0.1 * present.matrix.norm());

  NewtonMatrix newton(layout, {0});
  std::vector<double*> columns = columns_of(old.matrix);
  newton.set_reference(before.data());
  newton.set_present(after.data());
  ASSERT_TRUE(newton.factor(columns.data()));
  for (int k = 0; k < layout.size(); ++k) {
    Eigen::VectorXd x = present.matrix.col(k);
    newton.solve(columns.data(), x.data());
    EXPECT_LT((x - Eigen::VectorXd::Unit(layout.size(), k)).norm(), 1e-9) << k;
  }
}

TEST(NewtonMatrix, refuses_a_singular_matrix) {
  const StateLayout layout(2, 0, 0);
  Eigen::MatrixXd matrix = random_matrix(layout, 0.5);
  matrix.row(2).setZero();
  std::vector<double*> columns = columns_of(matrix);
  EXPECT_FALSE(NewtonMatrix(layout).factor(columns.data()));
}

}  // namespace
}  // namespace redysim
