#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "dynamics/loops/loop_correction.hpp"
#include "dynamics/straight_line/straight_line.hpp"
#include "model/read/model_file.hpp"
#include "support/evaluate.hpp"
#include "support/random_tree.hpp"

// The straight-line code that was written for slider_crank.toml, compiled, against the recursion. Its loop
// has three rows across the plane, without effect; the mechanism is singular where the rod covers the crank.

namespace redysim {
namespace {

using test::relative_difference;
using test::Vector;

class CompiledLoops : public testing::Test {
 protected:
  Model model = read_model_file(std::string(REDYSIM_MODELS) + "/slider_crank.toml").model;
  test::Evaluate<double> recursion{model};
  Plan<double>& plan = recursion.plan;
  Workspace<double> ws{plan};
  const std::size_t rows = ws.loop.b.size();

  // The links have equal lengths.
  static Vector closed_at(double crank) {
    Vector q(3);
    q << crank, -2 * crank - 3.141592653589793, -2 * std::sin(crank);
    return q;
  }
};

TEST_F(CompiledLoops, agree_with_the_recursion) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    test::Random random(seed);
    const Vector q = closed_at(-1.5 + 0.02 * seed) + 1e-3 * test::vector_of(random.numbers(3, 1)),
                 qd = test::vector_of(random.numbers(3, 3)), tau = test::vector_of(random.numbers(3, 5));
    Vector qdd(3);
    ASSERT_TRUE(straight_line_forward_dynamics(plan, q.data(), qd.data(), tau.data(), qdd.data(), nullptr));
    EXPECT_LT(relative_difference(qdd, recursion.qdd(q, qd, tau)), 1e-11);

    straight_line_residuals(plan, q.data(), qd.data(), ws.loop);
    const Vector residual = test::vector_of(ws.loop.residual);
    EXPECT_LT(relative_difference(residual, recursion.residual(q, qd)), 1e-14);
    EXPECT_LT(relative_difference(test::vector_of(ws.loop.rate), recursion.rate(q, qd)), 1e-14);

    test::Matrix C(rows, 3);  // column by column: its transpose row by row
    ASSERT_TRUE(straight_line_corrections(plan, q.data(), C.data()));
    recursion.qdd(q, qd, tau);  // the elimination of the corrections
    for (std::size_t row = 0; row < rows; ++row) recursion.ws.loop.b[row] = -ws.loop.residual[row];
    Vector change(3);
    correct_loops(plan, recursion.ws, change.data());
    EXPECT_LT((change + C.transpose() * residual).norm(), 1e-11 * change.norm());
  }
}

TEST_F(CompiledLoops, leave_singular_configurations_to_the_recursion) {
  const Vector q = closed_at(0), still = Vector::Zero(3);
  Vector qdd(3);
  test::Matrix C(rows, 3);
  EXPECT_FALSE(
      straight_line_forward_dynamics(plan, q.data(), still.data(), still.data(), qdd.data(), nullptr));
  EXPECT_FALSE(straight_line_corrections(plan, q.data(), C.data()));
}

}  // namespace
}  // namespace redysim
