#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "unit/integrate/rig.hpp"

namespace redysim {
namespace {

// A block that touches with the points of one side, of the other, of both or of none.
TEST(ContactRegions, distinguish_the_points_of_a_contact) {
  test::Rig rig("rocking_block", test::solver(SolverMethod::erk));
  const auto regions = [&](double height, double angle) {
    std::vector<double> y(static_cast<std::size_t>(rig.system.size()), 0.0), slope(y);
    y[1] = height;
    y[2] = angle;
    EXPECT_EQ(rig.system.right_hand_side(0, y.data(), slope.data()), Status::ok);
    return rig.system.contact_regions();
  };
  const std::uint64_t one = regions(0.401, 0.1), other = regions(0.401, -0.1), both = regions(0.39, 0),
                      none = regions(0.6, 0);
  EXPECT_EQ(none, 0);
  EXPECT_NE(one, none);
  EXPECT_NE(one, other);
  EXPECT_NE(both, one);
  EXPECT_NE(both, other);
}

}  // namespace
}  // namespace redysim
