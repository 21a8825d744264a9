#include "support/scene_tables.hpp"

#include <gtest/gtest.h>

#include <ostream>

#include "model/read/model_file.hpp"
#include "support/evaluate.hpp"

// Against the stored results of an independent program in 113-bit arithmetic (tests/scenes/README.md).

namespace redysim {
namespace {

using test::Evaluate;
using test::SceneTable;
using test::Vector;
using test::vector_of;

struct Scene {
  const char* model;
  const char* table;
};

// in the names that ctest lists, else bytes that change from run to run
void PrintTo(const Scene& scene, std::ostream* out) { *out << scene.table; }

std::string scene_name(const testing::TestParamInfo<Scene>& scene) { return scene.param.table; }

Model model_of(const std::string& name) {
  return read_model_file(std::string(REDYSIM_MODELS "/") + name + ".toml").model;
}

// Largest error of a row against its largest entry.
double row_error(const Vector& found, const Vector& expected) {
  return (found - expected).lpNorm<Eigen::Infinity>() / expected.lpNorm<Eigen::Infinity>();
}

class RandomStates : public testing::TestWithParam<Scene> {};

INSTANTIATE_TEST_SUITE_P(Scene, RandomStates,
                         testing::Values(Scene{"double_pendulum", "double_pendulum"},
                                         Scene{"gripper", "gripper_freefall"},
                                         Scene{"gripper_redysim", "gripper_redysim_freefall"},
                                         Scene{"kuka_kr5", "kr5_freefall"}),
                         scene_name);

TEST_P(RandomStates, forward_dynamics_agrees_to_1e_12) {
  Evaluate<double> tree(model_of(GetParam().model));
  const SceneTable table(std::string(GetParam().table) + "_fd");
  const int n = tree.nv();
  ASSERT_EQ(table.rows.size(), 50u);
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const Vector found = tree.qdd(vector_of(table.vector(row, "q", n)), vector_of(table.vector(row, "qd", n)),
                                  vector_of(table.vector(row, "tau", n)));
    EXPECT_LT(row_error(found, vector_of(table.vector(row, "qdd", n))), 1e-12) << row;
  }
}

TEST_P(RandomStates, inverse_dynamics_agrees_to_1e_12) {
  Evaluate<double> tree(model_of(GetParam().model));
  const SceneTable table(std::string(GetParam().table) + "_id");
  const int n = tree.nv();
  ASSERT_EQ(table.rows.size(), 50u);
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const Vector found = tree.tau(vector_of(table.vector(row, "q", n)), vector_of(table.vector(row, "qd", n)),
                                  vector_of(table.vector(row, "qdd", n)));
    EXPECT_LT(row_error(found, vector_of(table.vector(row, "tau", n))), 1e-12) << row;
  }
}

class Prescribed : public testing::TestWithParam<Scene> {};

INSTANTIATE_TEST_SUITE_P(Scene, Prescribed,
                         testing::Values(Scene{"gripper", "gripper_inverse"},
                                         Scene{"gripper_redysim", "gripper_redysim_inverse"},
                                         Scene{"kuka_kr5", "kr5_inverse"}),
                         scene_name);

TEST_P(Prescribed, torques_along_the_motion_agree) {
  Evaluate<double> tree(model_of(GetParam().model));
  const SceneTable table(GetParam().table);
  const int n = tree.nv();
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const Vector found = tree.tau(vector_of(table.vector(row, "q", n)), vector_of(table.vector(row, "qd", n)),
                                  vector_of(table.vector(row, "qdd", n)));
    EXPECT_LT(row_error(found, vector_of(table.vector(row, "tau", n))), 1e-12) << row;
  }
}

class Trajectory : public testing::TestWithParam<Scene> {};

INSTANTIATE_TEST_SUITE_P(
    Scene, Trajectory,
    testing::Values(Scene{"pendulum", "simple_pendulum"}, Scene{"double_pendulum", "double_pendulum"},
                    Scene{"gripper", "gripper_freefall"},
                    Scene{"gripper_redysim", "gripper_redysim_freefall"}, Scene{"kuka_kr5", "kr5_freefall"},
                    Scene{"four_bar", "fourbar_freefall"}, Scene{"four_bar", "fourbar_forced"}),
    scene_name);

TEST_P(Trajectory, accelerations_and_energies_agree_in_every_row) {
  Evaluate<double> tree(model_of(GetParam().model));
  const SceneTable table(GetParam().table);
  const int n = tree.nv();
  Vector tau = Vector::Zero(n);
  if (std::string(GetParam().table) == "fourbar_forced") tau[0] = 2;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const Vector q = vector_of(table.vector(row, "q", n)), qd = vector_of(table.vector(row, "qd", n));
    EXPECT_LT(row_error(tree.qdd(q, qd, tau), vector_of(table.vector(row, "qdd", n))), 2e-12) << row;
    const double kinetic = table.at(row, "kinetic"), potential = table.at(row, "potential");
    EXPECT_NEAR(tree.kinetic(q, qd), kinetic, 1e-13 * (1 + kinetic)) << row;
    EXPECT_NEAR(tree.potential(q, qd), potential, 1e-13 * (1 + std::abs(potential))) << row;
  }
}

// The driving torque makes forward dynamics give the prescribed motion back, with the same multipliers.
TEST(FourBarAtConstantSpeed, torque_column_reproduces_motion_and_multipliers) {
  Evaluate<double> tree(model_of("four_bar"));
  const SceneTable table("fourbar_inverse");
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const Vector q = vector_of(table.vector(row, "q", 3)), qd = vector_of(table.vector(row, "qd", 3));
    const Vector found = tree.qdd(q, qd, Vector{{table.at(row, "torque"), 0, 0}});
    const Vector expected = vector_of(table.vector(row, "qdd", 3));
    EXPECT_LT((found - expected).lpNorm<Eigen::Infinity>(), 1e-10) << row;
    const Vector lambda{{table.at(row, "lambda_x"), table.at(row, "lambda_y")}};
    EXPECT_LT((tree.lambda() - lambda).lpNorm<Eigen::Infinity>(), 1e-10) << row;
  }
}

}  // namespace
}  // namespace redysim
