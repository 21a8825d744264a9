#include "model/motion_scale.hpp"

#include <gtest/gtest.h>

#include "model/read/model_file.hpp"

namespace redysim {
namespace {

Model slide(const std::string& fields, const std::string& more = "") {
  return read_model_text("name = 'm'\n[[link]]\nname = 'base'\njoint = 'prismatic'\na = 100\n" + fields +
                             "[[link]]\nname = 'arm'\narmature = 1\n" + more,
                         "m.toml")
      .model;
}

double scale_of(const Model& model, int link) { return motion_scale(model, parameters_of(model), link); }
double scale_of(const std::string& fields, const std::string& more = "mass = 1\n") {
  return scale_of(slide(fields, more), 0);
}

TEST(MotionScale, of_a_slide_is_the_size_of_what_it_moves) {
  EXPECT_DOUBLE_EQ(scale_of("mass = 1\ncom = [3e-9, 0, 4e-9]\n"), 5e-9);
  EXPECT_DOUBLE_EQ(scale_of("mass = 2\ninertia = [1e-6, 1e-6, 2e-6]\n"), 1e-3);
  EXPECT_EQ(scale_of("mass = 1\n", "mass = 1\na = 2e-3\n"), 2e-3);
  // not where it sits, nor more than a metre
  EXPECT_EQ(scale_of("mass = 1\n"), 1);
  EXPECT_EQ(scale_of("mass = 1\ncom = [1000, 0, 0]\n"), 1);
}

TEST(MotionScale, of_a_slide_with_stops_is_the_way_between_them) {
  const std::string body = "mass = 1\ncom = [0.3, 0, 0]\nstop_stiffness = 1\n";
  EXPECT_DOUBLE_EQ(scale_of(body + "lower = -1e-9\nupper = 2e-9\n"), 3e-9);
  EXPECT_EQ(scale_of(body + "lower = -1e-9\n"), 0.3);
}

TEST(MotionScale, of_a_slide_on_a_spring_is_what_it_starts_with) {
  const std::string body = "mass = 1\ncom = [0.3, 0, 0]\nstiffness = 100\n";
  EXPECT_EQ(scale_of(body), 0.3);
  EXPECT_EQ(scale_of(body + "q = 1e-9\n"), 1e-9);
  EXPECT_EQ(scale_of(body + "q = 1e-9\nrest = 2e-6\n"), 2e-6 - 1e-9);
  EXPECT_DOUBLE_EQ(scale_of(body + "qd = 1e-6\n", "mass = 3\n"), 2e-7);
  EXPECT_EQ(scale_of(body + "q = 1e-300\n"), 1e-15);
  // without a spring the start says nothing about the motion
  EXPECT_EQ(scale_of("mass = 1\ncom = [0.3, 0, 0]\nq = 1e-9\n"), 0.3);
}

TEST(MotionScale, of_an_angle_is_one) {
  const Model model =
      slide("mass = 1\ncom = [1e-9, 0, 0]\n", "mass = 1\nlower = 0\nupper = 1e-9\nstop_stiffness = 1\n");
  EXPECT_EQ(scale_of(model, 1), 1);
}

}  // namespace
}  // namespace redysim
