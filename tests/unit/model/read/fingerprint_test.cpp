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
  EXPECT_EQ(fingerprint(""), "{d9aa0aa7-183d-e5aa-5e57-dae81922e0fb}");
  EXPECT_EQ(fingerprint("name = 'arm'\n"), "{abc54082-c440-d032-f094-5cadfb77f052}");
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
