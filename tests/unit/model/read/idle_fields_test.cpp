#include "model/read/idle_fields.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "unit/model/read.hpp"

namespace redysim::test {
namespace {

Lines idle(const std::string& text) {
  Lines found;
  for (const Diagnostic& diagnostic : idle_fields_of(text, "m.toml", read(text)))
    found.push_back(std::to_string(diagnostic.line) + ": " + diagnostic.message);
  return found;
}

const std::string spring = arm + "[[spring]]\nname = 's'\nlink_a = 'a'\nlink_b = 'ground'\n";    // to line 9
const std::string bushing = arm + "[[bushing]]\nname = 's'\nlink_a = 'a'\nlink_b = 'ground'\n";  // likewise
const std::string contact =
    arm + "[[contact]]\nname = 'c'\nlink_a = 'a'\nshape_a = 'sphere'\nradius_a = 1\nstiffness = 1\n";
const std::string move = "[[trajectory]]\njoint = 'a'\ntype = 'cycloid'\nduration = 1\n";

TEST(idle_fields, of_a_joint_are_named) {
  EXPECT_EQ(idle(arm + "rest = 1\n"), Lines{"6: link 'a': rest has no effect without stiffness"});
  EXPECT_EQ(idle(arm + "upper = 1\nstop_stiffness = 0\n"),
            Lines{"6: link 'a': upper has no effect without stop_stiffness"});
  EXPECT_EQ(idle(arm + "drive = 'locked'\nqd = 1\n"),
            Lines{"7: link 'a': qd has no effect on a locked joint"});
  EXPECT_EQ(idle(arm + "hold = true\n"),
            Lines{"6: link 'a': hold has no effect without loops and rigid couplings"});
  EXPECT_EQ(idle(arm + "[[link]]\nname = 'k'\njoint = 'fixed'\ncom = [1, 0, 0]\n"),
            Lines{"9: link 'k': com has no effect without mass"});
  EXPECT_EQ(idle(arm + "rest = 1\nstiffness = 2\nupper = 1\nstop_stiffness = 3\n"), Lines());
}

TEST(idle_fields, of_forces_are_named) {
  EXPECT_EQ(idle(spring), Lines{"7: spring 's': this spring has no effect without stiffness or damping"});
  EXPECT_EQ(idle(spring + "damping = 1\nrest_length = 5\n"),
            Lines{"11: spring 's': rest_length has no effect without stiffness"});
  EXPECT_EQ(idle(bushing + "stiffness = [0, 0, 0, 0, 0, 0]\n"),
            Lines{"7: bushing 's': this bushing has no effect without stiffness or damping"});
  EXPECT_EQ(idle(bushing + "stiffness = [0, 0, 0, 0, 0, 1]\n"), Lines());
  EXPECT_EQ(idle(contact + "friction_velocity = 1\nspin_velocity = 1\n"),
            (Lines{"12: contact 'c': friction_velocity has no effect without friction or static_friction",
                   "13: contact 'c': spin_velocity has no effect without rolling or torsion"}));
  EXPECT_EQ(idle(contact + "friction_velocity = 1\nfriction = 1\n"), Lines());
  EXPECT_EQ(idle(arm + "[[actuator]]\njoint = 'a'\n"),
            Lines{"7: actuator 1: this actuator has no effect without further fields"});
}

TEST(idle_fields, have_an_effect_with_a_tunable_parameter) {
  EXPECT_EQ(idle(arm + "rest = 1\n[fmu]\ntunable = ['a.stiffness']\n"), Lines());
}

TEST(idle_fields, are_groups_of_outputs_without_variables) {
  EXPECT_EQ(idle(arm + "[fmu]\noutputs = ['energy', 'reference', 'actuator', 'constraint_jacobian',\n"
                       "'parameter_jacobian']\n"),
            (Lines{"7: fmu: outputs 'reference' has no effect without a controller",
                   "7: fmu: outputs 'actuator' has no effect without an actuator other than a rigid gear",
                   "7: fmu: outputs 'constraint_jacobian' has no effect without loops and rigid couplings",
                   "8: fmu: outputs 'parameter_jacobian' has no effect without tunable parameters"}));
  EXPECT_EQ(idle(arm + "[[actuator]]\njoint = 'a'\ntorque_limit = 1\n[fmu]\noutputs = ['actuator']\n"),
            Lines());
}

TEST(idle_fields, that_look_like_degrees_are_named_unless_the_file_gives_the_unit) {
  const std::string rest =
      " rad is more than a full turn; set angle_unit = \"deg\" for degrees, or \"rad\" if it is right";
  EXPECT_EQ(idle(arm + "q = 90\n"), Lines{"6: link 'a': q = 90" + rest});
  EXPECT_EQ(idle(arm + "lower = -90\nstop_stiffness = 1\n"), Lines{"6: link 'a': lower = -90" + rest});
  EXPECT_EQ(idle(arm + "[[frame]]\nname = 'f'\nlink = 'a'\nrpy = [0, 90, 90]\n"),
            Lines{"9: frame 'f': rpy = 90" + rest});
  EXPECT_EQ(idle(arm + "[[shape]]\nlink = 'a'\nkind = 'sphere'\nradius = 1\nrpy = [0, 90, 0]\n"),
            Lines{"10: shape 1: rpy = 90" + rest});
  EXPECT_EQ(idle(arm + "drive = 'motion'\n" + move + "to = 60\n"), Lines{"11: trajectory 1: to = 60" + rest});
  for (const char* unit : {"deg", "rad"})
    EXPECT_EQ(idle("angle_unit = '" + std::string(unit) + "'\n" + arm + "q = 90\n"), Lines());
  for (const char* field : {"q = 6.28", "q = 18.85", "q = 100", "joint = 'prismatic'\nq = 30",
                            "joint = 'screw'\npitch = 1\nq = 30", "joint = 'free'\nq = [30, 0, 0, 0, 0, 0]"})
    EXPECT_EQ(idle(arm + field + "\n"), Lines()) << field;
  EXPECT_EQ(idle(arm + "joint = 'prismatic'\ndrive = 'motion'\n" + move + "to = 60\n"), Lines());
}

TEST(idle_fields, do_not_exist_in_the_shipped_models) {
  for (const auto& entry : std::filesystem::directory_iterator(REDYSIM_MODELS)) {
    if (entry.path().extension() != ".toml") continue;
    const std::string file = entry.path().string();
    EXPECT_TRUE(idle_fields(file, read_model_file(file).model).empty()) << file;
  }
}

TEST(idle_fields, a_target_of_a_joint_with_a_trajectory_is_named) {
  const std::string law = "[controller]\nlaw = 'pd'\nkp = 1\nkd = 1\n",
                    set = "[fmu]\ntunable = ['a.target']\n";
  EXPECT_EQ(idle(arm + law + set), Lines());
  EXPECT_EQ(idle(arm + move + "to = 1\n" + law + set),
            Lines{"16: fmu: tunable 'a.target' has no effect: its joint follows a trajectory"});
}

}  // namespace
}  // namespace redysim::test
