#include "dynamics/contact/surface_depth.hpp"

#include <gtest/gtest.h>

#include "math/dual.hpp"
#include "support/random_tree.hpp"

namespace redysim {
namespace {

template <class Scalar>
Surface<Scalar> surface(ShapeKind kind) {
  Surface<Scalar> out;
  out.kind = kind;
  out.half_size = Vec3<Scalar>(Scalar(0.5), Scalar(0.3), Scalar(0.2));
  out.radius = 0.4;
  out.half_length = 0.7;
  return out;
}

void expect_depth(ShapeKind kind, const Vec3<double>& p, double depth, const Vec3<double>& normal) {
  const SurfaceDepth<double> found = surface_depth(surface<double>(kind), p);
  EXPECT_NEAR(found.depth, depth, 1e-15);
  EXPECT_LT((found.normal - normal).norm(), 1e-15);
}

TEST(SurfaceDepth, of_a_box_counts_to_the_nearest_face_edge_or_corner) {
  expect_depth(ShapeKind::box, {0.45, 0.1, 0}, 0.05, {1, 0, 0});
  expect_depth(ShapeKind::box, {0, -0.29, 0.1}, 0.01, {0, -1, 0});
  expect_depth(ShapeKind::box, {0.1, 0.1, 0.5}, -0.3, {0, 0, 1});
  expect_depth(ShapeKind::box, {0.8, 0.7, 0}, -0.5, {0.6, 0.8, 0});
  expect_depth(ShapeKind::box, {-0.7, 0.4, -0.4}, -0.3, Vec3<double>(-2, 1, -2) / 3);
}

TEST(SurfaceDepth, of_round_shapes_counts_to_their_center_or_axis) {
  expect_depth(ShapeKind::sphere, {0, 0.3, 0.4}, -0.1, {0, 0.6, 0.8});
  expect_depth(ShapeKind::capsule, {0.3, 0, 0.6}, 0.1, {1, 0, 0});
  expect_depth(ShapeKind::capsule, {0.3, 0, 1.1}, -0.1, {0.6, 0, 0.8});
  expect_depth(ShapeKind::plane, {3, 4, -0.02}, 0.02, {0, 0, 1});
}

class Depth : public testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seed, Depth, testing::Range(0u, 20u));

TEST_P(Depth, its_gradient_is_its_derivative) {
  test::Random random(GetParam());
  const BicubicSpline terrain{5, 5, 0.3, random.numbers(25, 0.2)};
  for (const ShapeKind kind :
       {ShapeKind::plane, ShapeKind::sphere, ShapeKind::capsule, ShapeKind::box, ShapeKind::heightmap}) {
    Surface<Dual> at = surface<Dual>(kind);
    at.heights = &terrain;
    const Vec3<double> p = Vec3<double>(0.6, 0.6, 0.6) + random.vector(0.5), along = random.direction();
    const Vec3<Dual> moved(Dual(p.x(), along.x()), Dual(p.y(), along.y()), Dual(p.z(), along.z()));
    const SurfaceDepth<Dual> found = surface_depth(at, moved);
    double slope = 0, length = 0;
    for (int k = 0; k < 3; ++k) {
      slope += found.gradient[k].value * along[k];
      length += found.normal[k].value * found.normal[k].value;
    }
    EXPECT_NEAR(found.depth.derivative, slope, 1e-13);
    EXPECT_NEAR(length, 1, 1e-14);
  }
}

}  // namespace
}  // namespace redysim
