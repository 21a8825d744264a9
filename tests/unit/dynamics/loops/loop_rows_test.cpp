#include "dynamics/loops/loop_rows.hpp"

#include <gtest/gtest.h>

#include "support/evaluate.hpp"
#include "support/mechanisms.hpp"

namespace redysim {
namespace {

using test::Vector;
using test::vector_of;

TEST(LoopRows, parallelogram_is_closed_at_every_angle) {
  test::Evaluate<double> evaluate(test::four_bar_chain(1));
  const Vector still = Vector::Zero(3);
  for (double angle : {-1.2, 0.0, 0.7, 3.0})
    EXPECT_LT(evaluate.residual(vector_of({angle, angle, -angle}), still).norm(), 1e-15) << angle;
  // the coupler turned by d misses the rocker by 2 L sin(d / 2)
  const double turned = 0.3;
  EXPECT_NEAR(evaluate.residual(vector_of({0.7, 0.7, -0.7 + turned}), still).norm(),
              2 * 0.3 * std::sin(turned / 2), 1e-15);
}

TEST(LoopRows, rate_is_the_derivative_of_the_residual) {
  for (const Model& model : {test::four_bar_chain(2), test::overlapping_loops(3)}) {
    test::Evaluate<double> evaluate(model);
    const double h = 1e-6;
    Vector q(evaluate.nv()), qd(evaluate.nv());
    for (int i = 0; i < evaluate.nv(); ++i) {
      q[i] = std::sin(1.0 + i);
      qd[i] = std::cos(2.0 * i);
    }
    const Vector difference =
        (evaluate.residual(q + h * qd, qd) - evaluate.residual(q - h * qd, qd)) / (2 * h);
    EXPECT_LT((evaluate.rate(q, qd) - difference).norm(), 1e-8) << model.name;
  }
}

}  // namespace
}  // namespace redysim
