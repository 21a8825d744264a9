#include "model/read/model_error.hpp"

#include <gtest/gtest.h>

#include "unit/model/read.hpp"

namespace redysim::test {
namespace {

TEST(model_error, a_finding_prints_file_line_and_column) {
  try {
    read_model_text(arm + "mas = 1\n", "dir/arm.toml");
    FAIL();
  } catch (const ModelError& error) {
    EXPECT_EQ(error.reason(), ModelError::Reason::invalid);
    EXPECT_STREQ(error.what(), "dir/arm.toml:6:1: link 'a': unknown field 'mas'; did you mean 'mass'?");
  }
}

TEST(model_error, all_errors_come_at_once_and_in_file_order) {
  const std::string text =
      "name = 'm'\ngravty = [0, 0, 0]\n[fmu]\nstop_time = -1\n[[link]]\nname = 'a'\nmass = '1'\n"
      "[[link]]\nname = 'b'\nparent = 'c'\nmass = -1\n[solver]\nrtol = 2\n";
  EXPECT_EQ(
      errors(text),
      (Lines{"2: unknown field 'gravty'; did you mean 'gravity'?", "4: fmu: stop_time must be > 0, got -1",
             "7: link 'a': mass must be a number, got a string", "10: link 'b': parent 'c' is not a link",
             "11: link 'b': mass must be >= 0, got -1", "13: solver: rtol must be <= 0.1, got 2"}));
}

TEST(model_error, an_unreadable_file_says_so) {
  const std::pair<const char*, const char*> cases[] = {{"/nowhere/arm.toml", "does not exist"},
                                                       {"/", "is not a regular file"},
                                                       {"/dev/zero", "is not a regular file"}};
  for (const auto& [path, why] : cases) {
    try {
      read_model_file(path);
      FAIL();
    } catch (const ModelError& error) {
      EXPECT_EQ(error.reason(), ModelError::Reason::unreadable);
      EXPECT_EQ(error.what(), std::string(path) + ": the model file " + why);
    }
  }
}

TEST(model_error, a_syntax_error_has_its_place) {
  try {
    read_model_text("name = 'm'\nx = = 2\n", "m.toml");
    FAIL();
  } catch (const ModelError& error) {
    EXPECT_EQ(error.reason(), ModelError::Reason::syntax);
    ASSERT_EQ(error.diagnostics().size(), 1u);
    EXPECT_EQ(error.diagnostics()[0].line, 2);
    EXPECT_EQ(error.diagnostics()[0].message.rfind("TOML syntax: ", 0), 0u);
  }
}

TEST(model_error, common_slips_of_syntax_get_plain_words) {
  const std::string syntax = "TOML syntax: ";
  EXPECT_EQ(errors("name = \"m\nx = 1\n"),
            (Lines{"1: " + syntax + "a string has no closing quotation mark on its line"}));
  EXPECT_EQ(errors("name = \"m\xe4rz\"\n"),
            (Lines{"1: " + syntax + "the file is not UTF-8 text; save it as UTF-8"}));
  EXPECT_EQ(
      errors("x = 1,5\n"),
      (Lines{"1: " + syntax + "unexpected ',' after a value; write decimal numbers with a point: 1.5"}));
  EXPECT_EQ(errors("name: m\n"),
            (Lines{"1: " + syntax + "expected '=', saw ':'; a field is written name = value"}));
}

TEST(model_error, malformed_text_is_a_syntax_error_and_not_a_crash) {
  const std::string nested = std::string(100000, '[');
  for (const std::string text :
       {"[= 1", "x = [", "x = {a = {", "[[link", "x = 1e999", "x = 'a", "\xff", "x = 1\nx = 2"}) {
    try {
      read_model_text(text, "m.toml");
      FAIL() << text;
    } catch (const ModelError& error) {
      EXPECT_EQ(error.reason(), ModelError::Reason::syntax);
    }
  }
  std::string dotted = "a";
  for (int i = 0; i < 100000; ++i) dotted += ".a";
  EXPECT_EQ(errors("\n[" + dotted + "]\n"), (Lines{"2: TOML syntax: a key with more than 100 dots"}));
  EXPECT_THROW(read_model_text("x = " + nested, "m.toml"), ModelError);
}

TEST(model_error, an_empty_file_lacks_name_and_links) {
  EXPECT_EQ(errors(""), (Lines{"1: name is required", "1: a model needs at least one [[link]]"}));
  EXPECT_EQ(
      errors("name = \"" + std::string(201, 'a') + "\"\n[[link]]\nname = \"a\"\nmass = 1\ncom = [1, 0, 0]\n"),
      (Lines{"1: name is part of file names: at most 200 characters are possible"}));
  EXPECT_EQ(errors("name = 'm'\nlink = []\n"), (Lines{"2: a model needs at least one [[link]]"}));
}

TEST(model_error, wrong_types_name_both_types) {
  EXPECT_EQ(errors("name = 3\n" + arm.substr(11)), (Lines{"1: name must be a string, got a number"}));
  EXPECT_EQ(errors(arm + "hold = 1\n"), (Lines{"6: link 'a': hold must be true or false, got a number"}));
  EXPECT_EQ(errors(arm + "q = true\n"), (Lines{"6: link 'a': q must be a number, got true"}));
  EXPECT_EQ(errors(arm + "com = 3\n"), (Lines{"6: link 'a': com must be 3 numbers, got a number"}));
  EXPECT_EQ(errors(arm + "com = [1, 2]\n"), (Lines{"6: link 'a': com must be 3 numbers, got 2"}));
  EXPECT_EQ(errors(arm + "com = [1, 2, []]\n"), (Lines{"6: link 'a': com must contain numbers, got a list"}));
  EXPECT_EQ(errors(arm + "q = 1979-05-27\n"), (Lines{"6: link 'a': q must be a number, got a date or time"}));
  EXPECT_EQ(errors("name = 'm'\nlink = 3\n"), (Lines{"2: link must be written [[link]], once for each"}));
  EXPECT_EQ(errors("name = 'm'\nlink = [3]\n"), (Lines{"2: link must be written [[link]], once for each"}));
  EXPECT_EQ(errors(arm + "[[solver]]\n"), (Lines{"6: solver must be written [solver], once"}));
}

TEST(model_error, numbers_must_be_finite) {
  EXPECT_EQ(errors(arm + "q = nan\n"), (Lines{"6: link 'a': q must be finite, got nan"}));
  EXPECT_EQ(errors(arm + "com = [0, -inf, 0]\n"), (Lines{"6: link 'a': com must be finite, got -inf"}));
}

TEST(model_error, names_must_suit_fmi) {
  const std::string rule = " must be letters, digits and _ (ASCII) and not start with a digit";
  EXPECT_EQ(errors("name = '1m'\n" + arm.substr(11)), (Lines{"1: name '1m'" + rule}));
  EXPECT_EQ(errors("name = ''\n" + arm.substr(11)), (Lines{"1: name ''" + rule}));
  EXPECT_EQ(errors(arm + "joint_name = 'a b'\n"), (Lines{"6: link 'a': joint_name 'a b'" + rule}));
  EXPECT_EQ(errors(arm + "[[link]]\nmass = 1\ninertia = [1, 1, 1]\n"),
            (Lines{"6: link 2: name is required"}));
}

TEST(model_error, reserved_names_are_refused) {
  for (const std::string name : {"time", "energy", "solver", "gravity", "ground"})
    EXPECT_EQ(errors(arm + "joint_name = '" + name + "'\n"),
              (Lines{"6: link 'a': joint_name '" + name + "' is reserved"}));
}

TEST(model_error, a_name_has_one_owner) {
  EXPECT_EQ(errors(arm + "[[link]]\nname = 'a'\nmass = 1\ninertia = [1, 1, 1]\n"),
            (Lines{"7: link 'a': name 'a' is already used by link 'a' (line 3)"}));
  EXPECT_EQ(errors(arms + "joint_name = 'a'\n"),
            (Lines{"10: link 'b': joint_name 'a' is already used by link 'a' (line 3)"}));
  EXPECT_EQ(errors(arm + "joint_name = 'j'\n[[spring]]\nname = 'j'\nlink_a = 'ground'\nlink_b = 'a'\n"),
            (Lines{"8: spring 'j': name 'j' is already used by the joint of link 'a' (line 6)"}));
  EXPECT_TRUE(errors(arm + "joint_name = 'a'\n").empty());
}

TEST(model_error, wrong_words_list_the_right_ones) {
  EXPECT_EQ(
      errors(arm + "joint = 'revolut'\n"),
      (Lines{
          "6: link 'a': joint must be 'revolute', 'prismatic', 'screw', 'fixed', 'universal', 'cylindrical', "
          "'planar', 'spherical' or 'free', got 'revolut'; did you mean 'revolute'?"}));
  EXPECT_EQ(errors(arm + "drive = 'position'\n"),
            (Lines{"6: link 'a': drive must be 'torque', 'free', 'motion' or 'locked', got 'position'"}));
  EXPECT_TRUE(errors(arm + "[solver]\nmethod = 'auto'\n").empty());
  EXPECT_EQ(errors(arm + "[solver]\nmethod = 'euler'\n"),
            (Lines{"7: solver: method must be 'erk', 'adams', 'dirk', 'bdf', 'exponential', 'taylor' or "
                   "'auto', got 'euler'"}));
  EXPECT_EQ(errors("angle_unit = 'degrees'\n" + arm),
            (Lines{"1: angle_unit must be 'rad' or 'deg', got 'degrees'"}));
}

TEST(model_error, passive_joint_values_must_not_be_negative) {
  for (const std::string field : {"damping", "stiffness", "armature"})
    EXPECT_EQ(errors(arm + field + " = -2\n"), (Lines{"6: link 'a': " + field + " must be >= 0, got -2"}));
}

TEST(model_error, an_unknown_parent_suggests_one) {
  EXPECT_EQ(
      errors("name = 'm'\n[[link]]\nname = 'elbow'\nmass = 1\ninertia = [1, 1, 1]\n[[link]]\nname = 'hand'\n"
             "parent = 'elbwo'\nmass = 1\ninertia = [1, 1, 1]\n"),
      (Lines{"8: link 'hand': parent 'elbwo' is not a link; did you mean 'elbow'?"}));
}

TEST(model_error, a_ring_of_parents_is_reported_once) {
  EXPECT_EQ(errors("name = 'm'\n[[link]]\nname = 'x'\nparent = 'a'\n[[link]]\nname = 'a'\nparent = 'c'\n"
                   "[[link]]\nname = 'b'\nparent = 'a'\n[[link]]\nname = 'c'\nparent = 'b'\n"),
            (Lines{"7: link 'a': cyclic parent references: a -> c -> b -> a"}));
  EXPECT_EQ(errors(arm + "parent = 'a'\n"), (Lines{"6: link 'a': cyclic parent references: a -> a"}));
}

TEST(model_error, an_angle_of_the_other_unit_is_a_warning) {
  for (const char* key : {"alpha", "theta", "gamma"}) {
    const std::string field = std::string(key) + " = ";
    EXPECT_EQ(warnings(arm + field + "-90\n"),
              Lines{"6: link 'a': " + field +
                    "-90 rad is more than a full turn; for degrees set angle_unit = \"deg\""});
    EXPECT_EQ(warnings("angle_unit = 'deg'\n" + arm + field + "1.5707963\n"),
              Lines{"7: link 'a': " + field +
                    "1.5707963 deg is a multiple of pi/2; for radians set angle_unit = \"rad\""});
    for (const char* good : {"0", "6.283185307179586", "-3.14159265358979", "5"})
      EXPECT_EQ(warnings(arm + field + good + "\n"), Lines{}) << good;
    for (const char* good : {"0", "90", "-270", "720", "1.57", "6.3", "1e-9"})
      EXPECT_EQ(warnings("angle_unit = 'deg'\n" + arm + field + good + "\n"), Lines{}) << good;
  }
}

TEST(model_error, settings_have_bounds) {
  EXPECT_EQ(errors(arm + "[solver]\nrtol = 0\natol = -1\nmax_step = -1\nstep = 1\n"),
            (Lines{"7: solver: rtol must be > 0, got 0", "8: solver: atol must be >= 0, got -1",
                   "9: solver: max_step must be >= 0, got -1", "10: solver: unknown field 'step'"}));
  EXPECT_EQ(errors(arm + "[solver]\nmax_rhs = 7\n"),
            Lines{"7: solver: max_rhs must be 0 or at least 8, got 7"});
  EXPECT_EQ(errors(arm + "[solver]\nmax_rhs = 8.5\n"),
            Lines{"7: solver: max_rhs must be a whole number, got 8.5"});
  EXPECT_EQ(errors(arm + "[solver]\nmax_rhs = 20\nmethod = 'bdf'\n"),
            Lines{"7: solver: max_rhs requires the method 'auto' or 'erk', got 'bdf'"});
  EXPECT_TRUE(errors(arm + "[solver]\nrtol = 2.2250738585072014e-308\n").empty());
  EXPECT_EQ(
      errors(arm + "[solver]\nrtol = 1e-310\n"),
      (Lines{"7: solver: rtol must be > 0 and at least 2.2250738585072014e-308, got 9.99999999999997e-311"}));
  EXPECT_EQ(
      errors(arm + "[fmu]\noutputs = ['energi', 'solver', 'solver', 1]\nstep_size = 0\n"),
      (Lines{"7: fmu: outputs must be 'acceleration', 'energy', 'solver', 'momentum', 'reference', 'power', "
             "'actuator', 'step_jacobian', 'parameter_jacobian', 'mass_matrix', 'bias', 'gravity_torque', "
             "'coriolis', 'passive', 'reaction', 'regressor' or 'constraint_jacobian', got 'energi'; did you "
             "mean 'energy'?",
             "7: fmu: outputs lists 'solver' twice", "7: fmu: outputs must contain strings, got a number",
             "8: fmu: step_size must be > 0, got 0"}));
}

TEST(model_error, tunable_lists_parameters_that_exist) {
  EXPECT_EQ(
      errors(arm + "[fmu]\ntunable = [\n'a.mas',\n'a.mass',\n'a.mass',\n'a.com',\n'gravity[4]']\n"),
      (Lines{"8: fmu: tunable 'a.mas' is not a parameter of this model; did you mean 'a.mass'?",
             "10: fmu: tunable lists 'a.mass' twice",
             "11: fmu: tunable 'a.com' is not a parameter of this model; did you mean 'a.com[1]'?",
             "12: fmu: tunable 'gravity[4]' is not a parameter of this model; did you mean 'gravity[1]'?"}));
  EXPECT_EQ(errors(arm + "[[link]]\nname = 'b'\njoint = 'fixed'\n[fmu]\ntunable = ['b.damping']\n").size(),
            1u);
}

TEST(model_error, a_field_of_another_type_is_not_called_unknown) {
  EXPECT_EQ(errors(arm + "joint = 'spherical'\ndamping = 1\ndamp = 1\n"),
            (Lines{"7: link 'a': damping does not apply to this type of joint",
                   "8: link 'a': unknown field 'damp'"}));
  const std::string contact = arm + "[[contact]]\nname = 'c'\nlink_a = 'a'\n";
  EXPECT_EQ(errors(contact + "shape_a = 'box'\nsize_a = [1, 1, 1]\ntube_a = 1\nmu = 1\nstiffness = 1\n"),
            (Lines{"11: contact 'c': tube_a does not apply to this type of contact",
                   "12: contact 'c': mu does not apply to this type of contact"}));
  EXPECT_EQ(errors(arm + "duration = 1\n"), (Lines{"6: link 'a': unknown field 'duration'"}));
}

TEST(model_error, a_link_that_is_not_a_string_is_reported_once) {
  EXPECT_EQ(errors(arms + "parent = 1\n"), (Lines{"10: link 'b': parent must be a string, got a number"}));
  for (const std::string table :
       {"[[spring]]\nname = 's'\n", "[[loop]]\nname = 's'\ntype = 'spherical'\n",
        "[[contact]]\nname = 's'\nshape_a = 'sphere'\nradius_a = 1\nstiffness = 1\n"}) {
    const Lines found = errors(arms + table + "link_b = 'ground'\nlink_a = 1\n");
    ASSERT_EQ(found.size(), 1u) << table;
    EXPECT_NE(found[0].find("link_a must be a string, got a number"), std::string::npos);
  }
}

TEST(model_error, a_controller_without_joints_is_refused) {
  EXPECT_EQ(errors(arm + "[controller]\nlaw = 'pd'\nkp = 1\nkd = 1\njoints = []\n"),
            (Lines{"10: controller: joints must not be empty"}));
}

}  // namespace
}  // namespace redysim::test
