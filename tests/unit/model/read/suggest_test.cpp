#include "model/read/suggest.hpp"

#include <gtest/gtest.h>

namespace redysim {
namespace {

TEST(suggest, a_likely_misspelling_names_the_field) {
  const std::vector<std::string> fields = {"name", "mass", "inertia", "damping"};
  EXPECT_EQ(did_you_mean("mas", fields), "; did you mean 'mass'?");
  EXPECT_EQ(did_you_mean("Mass", fields), "; did you mean 'mass'?");
  EXPECT_EQ(did_you_mean("nmae", fields), "; did you mean 'name'?");
  EXPECT_EQ(did_you_mean("inertias", fields), "; did you mean 'inertia'?");
  EXPECT_EQ(did_you_mean("dampening", fields), "; did you mean 'damping'?");
}

TEST(suggest, the_name_that_others_use_leads_to_ours) {
  EXPECT_EQ(did_you_mean("type", {"joint", "com"}), "; did you mean 'joint'?");
  EXPECT_EQ(did_you_mean("center_of_mass", {"joint", "com"}), "; did you mean 'com'?");
  EXPECT_EQ(did_you_mean("type", {"com"}), "");
}

TEST(suggest, an_unlike_word_suggests_nothing) {
  EXPECT_EQ(did_you_mean("colour", {"name", "mass"}), "");
  EXPECT_EQ(did_you_mean("x", {"a", "b", "d"}), "");
  EXPECT_EQ(did_you_mean("", {"a"}), "");
  EXPECT_EQ(did_you_mean("mass", {}), "");
}

TEST(suggest, words_are_listed_as_in_a_sentence) {
  EXPECT_EQ(one_of({"a"}), "'a'");
  EXPECT_EQ(one_of({"a", "b"}), "'a' or 'b'");
  EXPECT_EQ(one_of({"a", "b", "c"}), "'a', 'b' or 'c'");
}

}  // namespace
}  // namespace redysim
