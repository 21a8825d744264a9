#include "fmi/boundary/log.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace redysim {
namespace {

using Lines = std::vector<std::string>;

void keep(fmi2ComponentEnvironment lines, fmi2String instance, fmi2Status status, fmi2String category,
          fmi2String message, ...) {
  static_cast<Lines*>(lines)->push_back(std::string(instance) + " " + std::to_string(status) + " " +
                                        category + " " + message);
}

struct LogTest : testing::Test {
  Lines lines;
  fmi2CallbackFunctions functions{keep, nullptr, nullptr, nullptr, &lines};

  // What gets through of one message of each kind.
  std::string shown(const Log& log) {
    lines.clear();
    log.error("e");
    log.warning("w");
    log.event("v");
    std::string kinds;
    for (const std::string& line : lines) kinds += line.back();
    return kinds;
  }
};

TEST_F(LogTest, errors_are_on_from_the_start) {
  EXPECT_EQ(shown(Log(&functions, "arm", false)), "e");
  EXPECT_EQ(shown(Log(&functions, "arm", true)), "ewv");
}

TEST_F(LogTest, lines_carry_instance_status_and_category) {
  Log(&functions, "arm", false).error("stuck");
  EXPECT_EQ(lines, Lines{"arm " + std::to_string(fmi2Error) + " logStatusError stuck"});
}

TEST_F(LogTest, named_categories_are_switched) {
  Log log(&functions, "arm", false);
  const char* warnings[] = {"logStatusWarning"};
  EXPECT_EQ(log.set(true, 1, warnings), nullptr);
  EXPECT_EQ(shown(log), "w");
  EXPECT_EQ(log.set(true, 0, nullptr), nullptr);
  EXPECT_EQ(shown(log), "ewv");
  EXPECT_EQ(log.set(false, 1, warnings), nullptr);
  EXPECT_EQ(shown(log), "ev");
  const char* all[] = {"logAll"};
  EXPECT_EQ(log.set(false, 1, all), nullptr);
  EXPECT_EQ(shown(log), "");
}

TEST_F(LogTest, unknown_category_changes_nothing) {
  Log log(&functions, "arm", false);
  const char* names[] = {"logAll", "logNoise"};
  EXPECT_STREQ(log.set(true, 2, names), "logNoise");
  EXPECT_EQ(shown(log), "e");
}

// The message is a printf format.
TEST_F(LogTest, percent_signs_are_doubled) {
  Log(&functions, "arm", false).error("100 % of %s");
  EXPECT_NE(lines.at(0).find("100 %% of %%s"), std::string::npos);
}

TEST_F(LogTest, of_fmi3_gets_plain_text) {
  const auto keep_text = [](fmi3InstanceEnvironment to, fmi3Status status, fmi3String category,
                            fmi3String message) {
    static_cast<Lines*>(to)->push_back(std::to_string(status) + " " + category + " " + message);
  };
  Log(keep_text, &lines, false).error("100 % of %s");
  EXPECT_EQ(lines, Lines{std::to_string(fmi3Error) + " logStatusError 100 % of %s"});
}

TEST(Log, without_a_logger_nothing_happens) {
  const fmi2CallbackFunctions none{};
  const fmi2CallbackFunctions* no_functions = nullptr;
  Log(no_functions, nullptr, true).error("lost");
  Log(&none, "arm", true).error("lost");
}

}  // namespace
}  // namespace redysim
