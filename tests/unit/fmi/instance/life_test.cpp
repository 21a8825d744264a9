#include "fmi/instance/life.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace redysim {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

TEST(Life, an_invalid_experiment_changes_nothing) {
  Life life;
  EXPECT_NE(life.set_up(true, 0, 1, false, 0), "");
  EXPECT_NE(life.set_up(false, 0, nan, false, 0), "");
  EXPECT_NE(life.set_up(false, 0, 1, true, 0.5), "");
  EXPECT_EQ(life.start_time, 0);
  EXPECT_EQ(life.stop_time, infinity);
  EXPECT_EQ(life.set_up(true, 1e-4, 1, true, 2), "");
  EXPECT_EQ(life.start_time, 1);
  EXPECT_EQ(life.stop_time, 2);
}

TEST(Life, a_step_starts_at_the_time_of_the_fmu_and_ends_before_the_stop_time) {
  Life life;
  ASSERT_EQ(life.set_up(false, 0, 0, true, 1), "");
  EXPECT_EQ(life.objection_to_step(0.5, 0.5, 0.5), "");
  EXPECT_EQ(life.objection_to_step(0.1 + 0.2, 0.3, 0.1), "");
  EXPECT_NE(life.objection_to_step(0.5, 0.6, 0.1), "");
  EXPECT_NE(life.objection_to_step(0.5, 0.5, 0.6), "");
  EXPECT_NE(life.objection_to_step(0.5, 0.5, -0.1), "");
  EXPECT_EQ(Life().objection_to_step(1e308, 1e308, 1.7e308),
            "the end of the communication step is not finite");
}

TEST(Life, the_tolerance_of_a_master_tightens_and_never_loosens) {
  SolverSettings settings;
  settings.rtol = 1e-6;
  settings.atol = 1e-8;
  Life life;
  ASSERT_EQ(life.set_up(true, 1e-8, 0, false, 0), "");
  EXPECT_DOUBLE_EQ(life.effective(settings).rtol, 1e-8);
  EXPECT_DOUBLE_EQ(life.effective(settings).atol, 1e-10);
  ASSERT_EQ(life.set_up(true, 1e-3, 0, false, 0), "");
  EXPECT_EQ(life.effective(settings).rtol, 1e-6);
  ASSERT_EQ(life.set_up(true, 1e-30, 0, false, 0), "");
  EXPECT_DOUBLE_EQ(life.effective(settings).rtol, 1e-13);
}

}  // namespace
}  // namespace redysim
