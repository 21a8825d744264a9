#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "integrate/system/system.hpp"
#include "model/read/model_file.hpp"
#include "support/allocation_count.hpp"

namespace redysim {
namespace {

// A model whose first joint has prescribed motion.
struct Moved {
  Model model;
  Plan<double> plan;
  System system;

  explicit Moved(const std::string& name = "double_pendulum")
      : model(read_model_file(REDYSIM_MODELS "/" + name + ".toml").model),
        plan(prescribed(model)),
        system(plan, true) {
    system.set_motion(0, 0, 0, 0, 0);
  }

  static const Model& prescribed(Model& model) {
    model.links[0].joint.drive = Drive::motion;
    return model;
  }
};

TEST(PrescribedMotion, the_first_jump_does_not_allocate) {
  Moved moved;
  std::vector<double> y(static_cast<std::size_t>(moved.system.size()), 0.0);
  moved.system.change_motion(0, 0, 0, 0.1);
  moved.system.change_motion(0, 0, 1, 2);
  const long before = test::allocations;
  const bool closed = moved.system.follow_jumps(0, y.data());
  EXPECT_EQ(test::allocations - before, 0);
  EXPECT_TRUE(closed);
  // the other joint answers
  EXPECT_NE(y[0], 0);
  EXPECT_NE(y[1], 0);
}

TEST(PrescribedMotion, a_jump_beyond_numbers_leaves_the_state) {
  Moved moved;
  const std::vector<double> start = {0.3, 0.7, 0};
  std::vector<double> y = start;
  ASSERT_EQ(static_cast<int>(y.size()), moved.system.size());
  moved.system.change_motion(0, 0, 1, std::numeric_limits<double>::max());
  EXPECT_FALSE(moved.system.follow_jumps(0, y.data()));
  EXPECT_EQ(y, start);
}

TEST(PrescribedMotion, a_jump_of_a_loop_leaves_velocities_that_close_it) {
  for (const char* name : {"four_bar", "five_bar"}) {
    Moved moved(name);
    std::vector<double> y(static_cast<std::size_t>(moved.system.size()), 0.0);
    const auto start_of = [&](int joint) {
      return moved.model.links[moved.plan.joints[joint].link].joint.q0;
    };
    for (int k = 0; k < moved.system.simple(); ++k) y[k] = start_of(moved.system.joint_of(k));
    moved.system.set_motion(0, 0, start_of(0), 0, 0);
    ASSERT_TRUE(moved.system.close_loops(0, y.data()));
    moved.system.change_motion(0, 0, 0, start_of(0) + 0.3);
    moved.system.change_motion(0, 0, 1, 3);
    ASSERT_TRUE(moved.system.follow_jumps(0, y.data()));
    moved.system.forget_jumps();
    std::vector<double> again = y;
    ASSERT_TRUE(moved.system.close_loops(0, again.data()));
    for (std::size_t k = 0; k < y.size(); ++k) EXPECT_NEAR(again[k], y[k], 1e-13) << name;
  }
}

}  // namespace
}  // namespace redysim
