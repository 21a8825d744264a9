#include "model/read/frame_reader.hpp"

#include <gtest/gtest.h>

#include "unit/model/read.hpp"

namespace redysim::test {
namespace {

// `fields` start on line 13, in a frame on link b.
std::string frame(const std::string& fields) {
  return arms + "[[frame]]\nname = 'f'\nlink = 'b'\n" + fields + "\n";
}

TEST(frame, shows_its_pose_unless_told_otherwise) {
  const Frame f = read(frame("")).frames.at(0);
  EXPECT_EQ(f.name, "f");
  EXPECT_EQ(f.link, 1);
  EXPECT_TRUE(f.position.isZero(0) && f.rotation.isIdentity(0));
  EXPECT_TRUE(f.pose && !f.rotation_matrix && !f.velocity);
  EXPECT_EQ(f.port, Frame::Port::none);
}

TEST(frame, its_outputs_are_those_listed) {
  const Frame f = read(frame("outputs = ['velocity', 'rotation']")).frames.at(0);
  EXPECT_TRUE(!f.pose && f.rotation_matrix && f.velocity);
  const Frame none = read(frame("outputs = []")).frames.at(0);
  EXPECT_TRUE(!none.pose && !none.rotation_matrix && !none.velocity);
  EXPECT_TRUE(!none.acceleration && !none.imu && !none.wrench);
  const Frame sensors = read(frame("outputs = ['acceleration', 'imu']")).frames.at(0);
  EXPECT_TRUE(sensors.acceleration && sensors.imu && !sensors.wrench);
}

// Lines 10 to 15 are the fixed link c and the frame on it.
TEST(frame, a_wrist_sensor_is_on_a_fixed_link) {
  const std::string on = "[[link]]\nname = 'c'\njoint = 'fixed'\n[[frame]]\nname = 'f'\n";
  EXPECT_TRUE(read(arms + on + "link = 'c'\noutputs = ['wrench']\n").frames.at(0).wrench);
  EXPECT_EQ(errors(arms + on + "link = 'b'\noutputs = ['wrench']\n"),
            (Lines{"16: frame 'f': outputs contains 'wrench', which requires a link with joint 'fixed', but "
                   "link 'b' can move relative to its parent"}));
}

TEST(frame, turns_by_roll_then_pitch_then_yaw_about_fixed_axes) {
  const Mat3<double> R = read("angle_unit = 'deg'\n" + frame("rpy = [90, 0, 90]")).frames.at(0).rotation;
  // roll takes y to z, yaw takes x to y: z stays where roll put y
  EXPECT_TRUE((R * Vec3<double>::UnitX()).isApprox(Vec3<double>::UnitY(), 1e-15));
  EXPECT_TRUE((R * Vec3<double>::UnitY()).isApprox(Vec3<double>::UnitZ(), 1e-15));
}

TEST(frame, its_port_is_in_ground_or_frame_axes) {
  EXPECT_EQ(read(frame("port = 'ground'")).frames.at(0).port, Frame::Port::ground_axes);
  EXPECT_EQ(read(frame("port = 'frame'")).frames.at(0).port, Frame::Port::frame_axes);
}

TEST(frame, its_required_fields_are_asked_for) {
  EXPECT_EQ(errors(arms + "[[frame]]\n"),
            (Lines{"10: frame 1: name is required", "10: frame 1: link is required"}));
}

TEST(frame, its_link_is_a_link) {
  EXPECT_EQ(errors(arms + "[[frame]]\nname = 'f'\nlink = 'c'\n"),
            (Lines{"12: frame 'f': link 'c' is not a link"}));
  EXPECT_EQ(errors(arms + "[[frame]]\nname = 'f'\nlink = 1\n"),
            (Lines{"12: frame 'f': link must be a string, got a number"}));
  EXPECT_EQ(errors("name = 'm'\n[[frame]]\nname = 'f'\n"),
            (Lines{"1: a model needs at least one [[link]]", "2: frame 'f': link is required"}));
  EXPECT_EQ(errors(arms + "[[frame]]\nname = 'f'\nlink = 'ground'\n"),
            (Lines{"12: frame 'f': link must be a moving or fixed link, not 'ground'"}));
}

TEST(frame, what_it_does_not_know_is_refused) {
  EXPECT_EQ(
      errors(frame("outputs = ['pose', 'velocty']")),
      (Lines{"13: frame 'f': outputs must be 'pose', 'rotation', 'velocity', 'acceleration', 'imu', "
             "'wrench', 'jacobian', 'jacobian_rate', 'inverse_inertia' or 'power', got 'velocty'; did you "
             "mean 'velocity'?"}));
  EXPECT_EQ(errors(frame("outputs = ['pose', 'pose']")),
            (Lines{"13: frame 'f': outputs lists 'pose' twice"}));
  EXPECT_EQ(errors(frame("port = 'world'")),
            (Lines{"13: frame 'f': port must be 'none', 'ground' or 'frame', got 'world'"}));
  EXPECT_EQ(errors(frame("offset = [1, 0, 0]")), (Lines{"13: frame 'f': unknown field 'offset'"}));
}

TEST(frame, power_is_that_of_a_port) {
  EXPECT_EQ(errors(frame("outputs = ['power']")),
            (Lines{"13: frame 'f': outputs contains 'power', which requires a port"}));
  EXPECT_TRUE(errors(frame("outputs = ['power']\nport = 'frame'")).empty());
}

TEST(frame, its_name_is_its_own) {
  EXPECT_EQ(errors(arms + "[[frame]]\nname = 'a'\nlink = 'b'\n").size(), 1u);
}

}  // namespace
}  // namespace redysim::test
