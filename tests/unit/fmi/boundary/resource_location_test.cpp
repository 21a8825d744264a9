#include "fmi/boundary/resource_location.hpp"

#include <gtest/gtest.h>

namespace redysim {
namespace {

using Folders = std::vector<std::string>;

TEST(ResourceLocation, every_form_of_a_uri_means_the_same_folder) {
  for (const char* uri : {"file:///data/arm", "file:/data/arm", "file:////data/arm",
                          "file://localhost/data/arm", "FILE:///data/arm", "file:///data/arm/"})
    EXPECT_EQ(resource_folders(uri), Folders{"/data/arm"}) << uri;
}

TEST(ResourceLocation, percent_codes_are_decoded_first) {
  EXPECT_EQ(resource_folders("file:///data/a%20b"), (Folders{"/data/a b", "/data/a%20b"}));
  // a plain path is tried as it is first
  EXPECT_EQ(resource_folders("/data/a%20b"), (Folders{"/data/a%20b", "/data/a b"}));
  EXPECT_EQ(resource_folders("file:///data/%C3%BC").front(), "/data/\xC3\xBC");
}

TEST(ResourceLocation, what_is_no_code_stays) {
  EXPECT_EQ(resource_folders("file:///data/50%"), Folders{"/data/50%"});
  EXPECT_EQ(resource_folders("file:///data/%zz%4"), Folders{"/data/%zz%4"});
  EXPECT_EQ(resource_folders("file:///data/%00x"), Folders{"/data/%00x"});  // no string ends in the middle
}

TEST(ResourceLocation, nothing_means_no_folder) {
  EXPECT_TRUE(resource_folders(nullptr).empty());
  EXPECT_TRUE(resource_folders("").empty());
  EXPECT_EQ(resource_folders("/"), Folders{"/"});
}

// tests/fmi/test_location.py covers the loaded library.
TEST(ResourceLocation, a_program_has_no_resources) { EXPECT_EQ(own_resource_folder(), ""); }

}  // namespace
}  // namespace redysim
