#include "fmi/describe/json.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>

namespace redysim {
namespace {

TEST(Json, commas_stand_between_members_only) {
  Json json;
  json.begin_object().member("a", 1).key("b").begin_array().value(2).value(true).null().end_array();
  json.key("c").begin_object().end_object().member("d", "x").end_object();
  EXPECT_EQ(json.text(), R"({"a":1,"b":[2,true,null],"c":{},"d":"x"})");
}

TEST(Json, text_is_escaped) {
  Json json;
  json.value("say \"a\\b\"\n\x01 \xC3\xBC");
  EXPECT_EQ(json.text(), "\"say \\\"a\\\\b\\\"\\u000a\\u0001 \xC3\xBC\"");
}

TEST(Json, numbers_read_back_exactly) {
  for (double number : {0.1, 1.0 / 3, -1e-300, std::nextafter(1.0, 2), std::numeric_limits<double>::max(),
                        std::numeric_limits<double>::denorm_min()}) {
    Json json;
    json.value(number);
    EXPECT_EQ(std::strtod(json.text().c_str(), nullptr), number) << json.text();
  }
}

}  // namespace
}  // namespace redysim
