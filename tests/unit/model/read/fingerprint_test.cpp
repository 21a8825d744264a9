#include "model/read/fingerprint.hpp"

#include <gtest/gtest.h>

#include <regex>
#include <set>

namespace redysim {
namespace {

TEST(fingerprint, is_a_guid_in_braces) {
  const std::regex guid("\\{[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\\}");
  for (const char* text : {"", "name = 'arm'", "\xff"})
    EXPECT_TRUE(std::regex_match(fingerprint(text), guid));
}

// Values from the same formula in Python; a change means that every FMU gets another GUID.
TEST(fingerprint, is_the_same_on_every_machine) {
  EXPECT_EQ(fingerprint(""), "{dc077c17-952d-9c36-4903-bdd8a62afdda}");
  EXPECT_EQ(fingerprint("name = 'arm'\n"), "{640902d3-abf9-f6e4-7108-86702199f066}");
}

TEST(fingerprint, every_single_byte_counts) {
  std::string text(200, 'a');
  std::set<std::string> seen = {fingerprint(text)};
  for (std::size_t i = 0; i < text.size(); ++i) {
    text[i] = 'b';
    seen.insert(fingerprint(text));
    text[i] = 'a';
  }
  seen.insert(fingerprint(text + "a"));
  seen.insert(fingerprint(text + std::string(1, '\0')));
  EXPECT_EQ(seen.size(), 203u);
}

}  // namespace
}  // namespace redysim
