#include "fmi/boundary/arrays.hpp"

#include <gtest/gtest.h>

namespace redysim {
namespace {

TEST(Arrays, are_needed_only_where_there_are_entries) {
  const double values[2] = {};
  EXPECT_EQ(objection_to_arrays(0, {nullptr, nullptr}), nullptr);
  EXPECT_EQ(objection_to_arrays(2, {values}), nullptr);
  EXPECT_NE(objection_to_arrays(2, {values, nullptr}), nullptr);
}

TEST(Arrays, counts_beyond_any_memory_are_refused) {
  const double values[2] = {};
  EXPECT_NE(objection_to_arrays(static_cast<std::size_t>(-1), {values}), nullptr);
}

}  // namespace
}  // namespace redysim
