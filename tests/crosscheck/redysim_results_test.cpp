#include <gtest/gtest.h>

#include "model/read/model_file.hpp"
#include "support/dense.hpp"
#include "support/evaluate.hpp"

// Against results printed by ReDySim (7 digits) and against figures of an independent Newton-Euler program.

namespace redysim {
namespace {

using test::Evaluate;
using test::Vector;

Model model_of(const std::string& name) {
  return read_model_file(std::string(REDYSIM_MODELS "/") + name + ".toml").model;
}

// Cycloidal motion of all joints from q0 to qf within one second.
struct Cycloid {
  Vector q, qd, qdd;
  Cycloid(const Vector& q0, const Vector& qf, double time) {
    constexpr double turn = 6.283185307179586;
    const Vector step = qf - q0;
    q = q0 + step * (time - std::sin(turn * time) / turn);
    qd = step * (1 - std::cos(turn * time));
    qdd = step * turn * std::sin(turn * time);
  }
};

TEST(ReDySim, kuka_torques_agree_to_the_printed_digits) {
  struct Printed {
    double time;
    Vector tau;
  };
  const Printed printed[] = {
      {0, Vector{{0, 128.7117, 14.53612, 0, 0, 0}}},
      {0.25, Vector{{106.0031, 209.5310, 35.72768, -8.613520e-4, -0.1753215, 1.012746e-5}}},
      {0.5, Vector{{-39.53028, 150.3598, 21.46336, 0.1967606, -0.3236363, 6.465742e-6}}},
      {0.75, Vector{{-74.10312, 2.827468, -8.699738, -0.2915365, -0.06236583, -3.761628e-5}}},
      {1, Vector{{0, 66.78584, 9.698057, 0.1305619, 0.05428358, 0}}},
  };
  Evaluate<double> kuka(model_of("kuka_kr5"));
  for (const Printed& row : printed) {
    const Cycloid motion(Vector::Zero(6), Vector::Constant(6, std::acos(-1.0) / 3), row.time);
    const Vector tau = kuka.tau(motion.q, motion.qd, motion.qdd);
    for (int i = 0; i < 6; ++i)
      EXPECT_NEAR(tau[i], row.tau[i], 6e-7 * std::abs(row.tau[i]) + 1e-12)
          << row.time << " s, joint " << i + 1;
  }
}

TEST(IndependentProgram, kuka_torque_at_one_state) {
  Evaluate<double> kuka(model_of("kuka_kr5"));
  const Vector q{{.1, -.2, .3, -.4, .5, -.6}}, qd{{.6, -.5, .4, -.3, .2, -.1}},
      qdd{{1, -1, .5, -.5, .25, -.25}};
  const Vector expected{
      {13.41607638297, 118.1349645213, 13.76804948910, -0.01527819868, -0.12020851538, -2.442135087e-6}};
  const Vector tau = kuka.tau(q, qd, qdd);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(tau[i], expected[i], 1e-9 * std::abs(expected[i]) + 1e-11) << i;
}

TEST(IndependentProgram, kuka_inertia_at_zero) {
  Evaluate<double> kuka(model_of("kuka_kr5"));
  const auto M = kuka.inertia(Vector::Zero(6));
  const double diagonal[] = {14.7943, 9.16421, 1.09121, 0.0140917, 0.00276559, 1.652e-6};
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(M(i, i), diagonal[i], 1e-5 * diagonal[i]) << i;
  const Vector eigenvalues = test::eigenvalues(M);
  EXPECT_NEAR(eigenvalues[5] / eigenvalues[0], 9.0e6, 0.05e6);
}

TEST(IndependentProgram, kuka_start_acceleration) {
  Evaluate<double> kuka(model_of("kuka_kr5"));
  const Vector expected{
      {-4.144612897e-4, -18.38664091, 20.14824078, 0.5702649957, 8.385306827, -0.5706794570}};
  const Vector zero = Vector::Zero(6), qdd = kuka.qdd(zero, zero, zero);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(qdd[i], expected[i], 1e-9 * std::abs(expected[i])) << i;
}

TEST(IndependentProgram, pppr_torque_at_one_state) {
  Evaluate<double> pppr(model_of("pppr"));
  const Vector tau = pppr.tau(Vector{{.06, .07, .08, .3}}, Vector{{.1, .2, .3, .4}}, Vector{{1, -1, .5, 2}});
  const Vector expected{{2.48140264371, -1.54658474363, 1.48140264371, 0.016134737812}};
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(tau[i], expected[i], 1e-10) << i;
}

TEST(IndependentProgram, long_chain_start_acceleration_alternates) {
  Evaluate<double> chain(model_of("long_chain"));
  const Vector zero = Vector::Zero(20), qdd = chain.qdd(zero, zero, zero);
  const double expected[] = {-414.6194, 525.7163, -140.8653, 37.74473, -10.11367, 2.709950};
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(qdd[i], expected[i], 1e-6 * std::abs(expected[i])) << i;
}

TEST(IndependentProgram, gripper_torques_along_the_cycloid) {
  Evaluate<double> gripper(model_of("gripper_redysim"));
  const double degree = std::acos(-1.0) / 180;
  const Vector q0{{0, 0, 0, 90 * degree}}, qf{{60 * degree, 80 * degree, 80 * degree, 120 * degree}};
  const Vector expected[] = {Vector{{0.8829, 0.1962, 0.04905, 0}},
                             Vector{{0.97437109, 0.22672515, 0.05743535, -0.00513509}},
                             Vector{{0.54092872, 0.03430231, -0.0107784, -0.03362433}},
                             Vector{{0.14881974, -0.1528396, -0.04680174, -0.0491989}},
                             Vector{{0.14400208, -0.15029792, -0.03757448, -0.04905}}};
  for (int k = 0; k < 5; ++k) {
    const Cycloid motion(q0, qf, 0.25 * k);
    EXPECT_LT((gripper.tau(motion.q, motion.qd, motion.qdd) - expected[k]).lpNorm<Eigen::Infinity>(), 2e-8)
        << k;
  }
}

}  // namespace
}  // namespace redysim
