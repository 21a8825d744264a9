#include "dynamics/joint_transform.hpp"

#include <gtest/gtest.h>

#include "dynamics/bias.hpp"
#include "support/evaluate.hpp"
#include "support/random_tree.hpp"

namespace redysim {
namespace {

// A wrench moved to the parent has the power there that it has on the body.
TEST(JointTransform, power_is_the_same_on_both_sides) {
  test::Random random(3);
  for (unsigned seed = 0; seed < test::tree_seeds; ++seed) {
    test::Random source(seed);
    const Model model = test::random_tree(source, test::options_of(seed));
    test::Evaluate<double> evaluate(model);
    const std::vector<double> q = random.numbers(evaluate.nv(), 2);
    set_positions(evaluate.plan, evaluate.ws, q.data());
    for (std::size_t i = 0; i < evaluate.plan.joints.size(); ++i) {
      const JointPlan<double>& joint = evaluate.plan.joints[i];
      const Motion<double> before{random.vector(1), random.vector(1)};
      Motion<double> motion = before;
      const Force<double> on_body{random.vector(1), random.vector(1)};
      Force<double> force = on_body;
      to_body(joint, evaluate.ws.joints[i], motion);
      to_parent(joint, evaluate.ws.joints[i], force);
      EXPECT_NEAR(dot(on_body, motion), dot(force, before), 1e-13) << "seed " << seed << ", joint " << i;
    }
  }
}

}  // namespace
}  // namespace redysim
