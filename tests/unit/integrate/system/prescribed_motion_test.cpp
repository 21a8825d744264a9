#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "integrate/system/system.hpp"
#include "model/read/model_file.hpp"
#include "support/allocation_count.hpp"

namespace redysim {
namespace {

// A double pendulum whose first joint has prescribed motion.
struct Moved {
  Model model = read_model_file(REDYSIM_MODELS "/double_pendulum.toml").model;
  Plan<double> plan;
  System system;

  Moved() : plan(prescribed(model)), system(plan, true) { system.set_motion(0, 0, 0, 0, 0); }

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

}  // namespace
}  // namespace redysim
