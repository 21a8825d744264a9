#include <gtest/gtest.h>

#include "dynamics/loops/loop_correction.hpp"
#include "support/dense.hpp"
#include "support/mechanisms.hpp"
#include "support/random_loops.hpp"

namespace redysim {
namespace {

using test::all_loop_types;
using test::ClosedCase;
using test::dense_solution;
using test::DenseSolution;
using test::derivative;
using test::Evaluate;
using test::Matrix;
using test::Random;
using test::random_case;
using test::relative_difference;
using test::Vector;

// Which rows depend on others is beyond dispute: no eigenvalue of S (rows scaled to one) lies between
// rounding and size one.
bool rank_is_clear(const Matrix& S) {
  const Vector scale = S.diagonal().cwiseMax(1e-20).cwiseSqrt().cwiseInverse();
  const Matrix scaled = scale.asDiagonal() * S * scale.asDiagonal();
  const Vector sizes = test::eigenvalues(scaled);
  return std::none_of(sizes.begin(), sizes.end(), [](double size) { return size > 1e-13 && size < 1e-6; });
}

// Smallest part of a kept row that the rows before it do not explain. The factor is made without exchanging
// rows, so an almost dependent early row blurs the rank of the later ones: accelerations tolerate this, the
// distribution of the multipliers does not.
double smallest_pivot(Evaluate<double>& tree, const Matrix& S) {
  double smallest = 1;
  for (const ClusterPlan& cluster : tree.plan.clusters)
    for (int k = 0; k < cluster.row_count && !(tree.ws.loop.by_fronts && cluster.split); ++k) {
      EnvelopeCholesky<double>& factor = tree.ws.loop.S[&cluster - tree.plan.clusters.data()];
      const double pivot = factor.entry(k, k) * factor.entry(k, k);
      const double row = S(cluster.first_row + k, cluster.first_row + k);
      if (pivot > 0) smallest = std::min(smallest, pivot / row);
    }
  return smallest;
}

void expect_dense_agreement(const ClosedCase& c, double tolerance) {
  Evaluate<double> tree(c.model);
  const DenseSolution dense = dense_solution(c.model, c.q, c.qd, c.tau);
  if (!rank_is_clear(dense.S)) return;
  const Vector qdd = tree.qdd(c.q, c.qd, c.tau), lambda = tree.lambda();
  EXPECT_LT(relative_difference(qdd, dense.qdd), tolerance);
  // M qdd + bias = tau + J^T lambda, whatever the distribution
  const Vector force = dense.M * dense.qdd + dense.bias - c.tau;
  EXPECT_LT(relative_difference(dense.J.transpose() * lambda, force), 10 * tolerance);
  const double pivot = smallest_pivot(tree, dense.S);
  if (pivot < 1e-5) return;
  EXPECT_EQ(tree.rank(), dense.rank);
  EXPECT_LT(relative_difference(lambda, dense.lambda), tolerance * std::max(1.0, 1e-3 / pivot));
}

class RandomLoops : public testing::TestWithParam<unsigned> {
 protected:
  Random random{GetParam()};
};

INSTANTIATE_TEST_SUITE_P(Seed, RandomLoops, testing::Range(0u, 40u));
// a row that those before it explain to 1e-5, and one behind it completely
INSTANTIATE_TEST_SUITE_P(NearlyDependentRows, RandomLoops,
                         testing::Values(119u, 307u, 1442u, 1662u, 2029u, 2381u, 2468u, 2618u));

TEST_P(RandomLoops, one_loop_agrees_with_a_dense_solve) {
  for (const LoopType type : all_loop_types) {
    SCOPED_TRACE(static_cast<int>(type));
    expect_dense_agreement(random_case(random, 10, 1, {type}), 1e-9);
  }
}

TEST_P(RandomLoops, several_loops_agree_with_a_dense_solve) {
  for (int loops = 2; loops <= 4; ++loops) {
    SCOPED_TRACE(loops);
    expect_dense_agreement(
        random_case(random, 14, loops, {LoopType::spherical, LoopType::point, LoopType::universal}), 1e-8);
  }
}

TEST_P(RandomLoops, a_loop_given_twice_is_the_same_motion) {
  ClosedCase c = random_case(random, 10, 1, {LoopType::spherical, LoopType::universal, LoopType::fixed});
  const Vector once = Evaluate<double>(c.model).qdd(c.q, c.qd, c.tau);
  c.model.loops.push_back(c.model.loops.front());
  Evaluate<double> twice(c.model);
  EXPECT_LT(relative_difference(twice.qdd(c.q, c.qd, c.tau), once), 1e-9);
  if (smallest_pivot(twice, dense_solution(c.model, c.q, c.qd, c.tau).S) < 1e-5) return;
  // least norm: both carry the same share
  const Vector lambda = twice.lambda();
  EXPECT_LT(relative_difference(lambda.head(lambda.size() / 2), lambda.tail(lambda.size() / 2)), 1e-8);
  expect_dense_agreement(c, 1e-8);
}

TEST_P(RandomLoops, a_loop_that_repeats_a_joint_changes_nothing) {
  test::TreeOptions options;
  options.links = 8;
  options.massless = options.springs = false;
  Model model = test::random_tree(random, options);
  const int n = test::moving_joints(model);
  const Vector q = test::vector_of(random.numbers(n, 2)), qd = test::vector_of(random.numbers(n, 2)),
               tau = test::vector_of(random.numbers(n, 5));
  const Vector free = Evaluate<double>(model).qdd(q, qd, tau);
  const std::vector<Pose> poses = test::poses_at(model, q);
  for (int link = 0; link < options.links; ++link) {
    if (model.links[link].joint.type == JointType::fixed || random.chance(0.5)) continue;
    model.loops.push_back(test::repeated_joint(random, model, link));
    test::match_ends(model.loops.back(), poses);
  }
  Evaluate<double> tree(model);
  EXPECT_LT(relative_difference(tree.qdd(q, qd, tau), free), 1e-12);
  EXPECT_EQ(tree.rank(), 0);
  EXPECT_LT(tree.lambda().lpNorm<Eigen::Infinity>(), 1e-12);
}

// Their rows have levers of rounding only, which must not count beside those of the other loop.
TEST_P(RandomLoops, repeated_joints_change_no_other_loop) {
  ClosedCase c = random_case(random, 8, 1, {LoopType::cylindrical, LoopType::spherical, LoopType::universal});
  const Vector once = Evaluate<double>(c.model).qdd(c.q, c.qd, c.tau);
  const std::vector<Pose> poses = test::poses_at(c.model, c.q);
  std::vector<Loop> repeated;
  for (int link = 0; link < static_cast<int>(c.model.links.size()); ++link) {
    if (c.model.links[link].joint.type == JointType::fixed) continue;
    repeated.push_back(test::repeated_joint(random, c.model, link));
    test::match_ends(repeated.back(), poses);
  }
  c.model.loops.insert(c.model.loops.begin(), repeated.begin(), repeated.end());
  EXPECT_LT(relative_difference(Evaluate<double>(c.model).qdd(c.q, c.qd, c.tau), once), 1e-9);
}

TEST_P(RandomLoops, are_the_same_in_any_unit_of_length) {
  ClosedCase c = random_case(random, 10, 2, {LoopType::spherical, LoopType::revolute, LoopType::fixed});
  c.model.springs.clear();
  for (Link& link : c.model.links) {
    const double armature = link.joint.armature;
    link.joint =
        Joint{{}, link.joint.name, link.joint.type, link.joint.drive, link.joint.dh, link.joint.pitch};
    link.joint.armature = armature;
  }
  c.model.loops.push_back(c.model.loops.front());
  const Vector none = Vector::Zero(c.q.size());
  const Vector once = Evaluate<double>(c.model).qdd(c.q, c.qd, none);
  for (const double size : {0x1p-20, 0x1p-10, 0x1p10}) {
    SCOPED_TRACE(size);
    Vector unit = Vector::Ones(c.q.size());
    Eigen::Index next = 0;
    for (const Link& link : c.model.links)
      if (link.joint.type != JointType::fixed)
        unit[next++] = link.joint.type == JointType::prismatic ? size : 1;
    Evaluate<double> tree(test::resized(c.model, size));
    const Vector qdd = tree.qdd(c.q.cwiseProduct(unit), c.qd.cwiseProduct(unit), none);

    EXPECT_LT(relative_difference(qdd.cwiseQuotient(unit), once), 1e-12);
  }
}

// A closed mechanism of 10 um on a platform of 1 m that moves: residuals and rates are rounding of 10 um.
TEST_P(RandomLoops, are_as_exact_on_a_large_moving_platform) {
  constexpr double size = 0x1p-17;
  ClosedCase c = random_case(random, 8, 2, {LoopType::spherical, LoopType::revolute, LoopType::fixed});
  c.model.springs.clear();
  Model carried = test::resized(c.model, size);
  Link platform = carried.links.front();
  platform.joint = Joint();
  platform.joint.name = "platform";
  platform.joint.type = JointType::revolute;
  platform.joint.dh.a = 1.3;
  platform.joint.dh.d = 0.4;
  platform.parent = ground;
  for (Link& link : carried.links) ++link.parent;  // ground is -1, the platform 0
  for (Loop& loop : carried.loops) {
    ++loop.link_a;
    ++loop.link_b;
  }
  carried.links.insert(carried.links.begin(), platform);
  Vector unit = Vector::Ones(c.q.size());
  Eigen::Index next = 0;
  for (const Link& link : c.model.links)
    if (link.joint.type != JointType::fixed)
      unit[next++] = link.joint.type == JointType::prismatic ? size : 1;
  const Vector q = c.q.cwiseProduct(unit), qd = c.qd.cwiseProduct(unit);
  Vector carried_q(q.size() + 1), carried_qd(q.size() + 1);
  carried_q << 0.7, q;
  carried_qd << 3.0, qd;
  Evaluate<double> moving(carried);
  const auto position_rows = [](const Evaluate<double>& tree, const Vector& of) {
    double largest = 0;
    for (const auto& loop : tree.plan.loops)
      for (std::size_t k = 0; k < loop.rows.size(); ++k)
        if (loop.rows[k].kind != ConstraintRow<double>::Kind::rotation)
          largest = std::max(largest, std::abs(of[loop.first_row + static_cast<int>(k)]));
    return largest;
  };
  EXPECT_LT(position_rows(moving, moving.residual(carried_q, carried_qd)), 1e-13 * size);
  EXPECT_LT(position_rows(moving, moving.rate(carried_q, carried_qd)), 1e-12 * size);
}

TEST_P(RandomLoops, rates_and_accelerations_are_derivatives_of_the_residuals) {
  const ClosedCase c = random_case(random, 10, 2, {std::begin(all_loop_types), std::end(all_loop_types)});
  Evaluate<double> tree(c.model);
  Evaluate<Dual> exact(c.model);
  const Vector zero = Vector::Zero(c.q.size());
  const Vector residual_rate = derivative(exact.residual(test::dual(c.q, c.qd), test::dual(zero, zero)));
  EXPECT_LT(relative_difference(tree.rate(c.q, c.qd), residual_rate), 1e-12);
  // closed accelerations: the rates stay zero along the motion
  const Vector qdd = tree.qdd(c.q, c.qd, c.tau);
  if (tree.rank() == tree.lambda().size()) {
    const Vector change = derivative(exact.rate(test::dual(c.q, c.qd), test::dual(c.qd, qdd)));
    EXPECT_LT(change.lpNorm<Eigen::Infinity>(), 1e-9 * std::max(1.0, qdd.lpNorm<Eigen::Infinity>()));
  }
}

TEST_P(RandomLoops, residuals_by_dual_numbers_agree_with_differences) {
  const ClosedCase c = random_case(random, 10, 2, {std::begin(all_loop_types), std::end(all_loop_types)});
  Evaluate<double> tree(c.model);
  const Matrix J = test::loop_jacobian(c.model, c.q);
  const double h = 1e-6;
  for (Eigen::Index j = 0; j < c.q.size(); ++j) {
    const Vector step = h * Vector::Unit(c.q.size(), j);
    const Vector slope = (tree.residual(c.q + step, c.qd) - tree.residual(c.q - step, c.qd)) / (2 * h);
    EXPECT_LT(relative_difference(J.col(j), slope), 1e-8) << j;
  }
}

TEST_P(RandomLoops, constraint_forces_do_no_work) {
  for (int repeat = 0; repeat < 40; ++repeat) {
    const ClosedCase c = random_case(random, 12, 2, {std::begin(all_loop_types), std::end(all_loop_types)});
    Evaluate<double> tree(c.model);
    Evaluate<Dual> exact(c.model);
    const Vector qdd = tree.qdd(c.q, c.qd, c.tau), lambda = tree.lambda();
    const auto q = test::dual(c.q, c.qd), qd = test::dual(c.qd, qdd);
    const double rate = exact.kinetic(q, qd).derivative + exact.potential(q, qd).derivative;
    const double scale = 1 + (tree.inertia(c.q) * qdd).cwiseAbs().dot(c.qd.cwiseAbs());
    const double of_rounding = lambda.dot(tree.rate(c.q, c.qd));  // zero if the velocities are exactly closed
    EXPECT_NEAR(rate, tree.power(c.q, c.qd, c.tau) + of_rounding, 1e-9 * scale);
  }
}

TEST_P(RandomLoops, forward_dynamics_by_dual_numbers_agrees_with_differences) {
  // long arms, so that no pose is singular
  Model model = test::serial_chain(9, false);
  const Vector q = test::vector_of(random.numbers(9, 1));
  const LoopType type = random.chance(0.5) ? LoopType::spherical : LoopType::universal;
  model.loops = {test::closed_loop(random, type, 0, 8, test::poses_at(model, q))};
  Evaluate<double> tree(model);
  Evaluate<Dual> exact(model);
  const auto numbers = [this] { return test::vector_of(random.numbers(9, 1)); };
  const Vector qd = test::closed_velocity(model, q, numbers()), tau = numbers();
  const Vector dq = numbers(), dqd = numbers(), dtau = numbers();
  const Vector found = derivative(exact.qdd(test::dual(q, dq), test::dual(qd, dqd), test::dual(tau, dtau)));
  const double h = 1e-6;
  const Vector slope = (tree.qdd(q + h * dq, qd + h * dqd, tau + h * dtau) -
                        tree.qdd(q - h * dq, qd - h * dqd, tau - h * dtau)) /
                       (2 * h);
  EXPECT_LT(relative_difference(found, slope), 1e-5);
}

TEST_P(RandomLoops, corrections_are_the_smallest_in_the_mass_metric) {
  const ClosedCase c = random_case(random, 10, 2, {LoopType::spherical, LoopType::universal});
  Evaluate<double> tree(c.model);
  tree.qdd(c.q, c.qd, c.tau);
  const DenseSolution dense = dense_solution(c.model, c.q, c.qd, c.tau);
  // a residual that a motion can take away
  const Vector r = dense.J * test::vector_of(random.numbers(tree.nv(), 1));
  for (Eigen::Index row = 0; row < r.size(); ++row) tree.ws.loop.b[row] = -r[row];
  Vector delta(tree.nv());
  correct_loops(tree.plan, tree.ws, delta.data());
  const Vector expected =
      -test::solve_definite(dense.M, dense.J.transpose() * (test::pseudo_inverse(dense.S).matrix * r));
  EXPECT_LT(relative_difference(delta, expected), 1e-8);
}

// --- named mechanisms
// ---------------------------------------------------------------------------------------

// A cut joint between two given links of a given tree at a random pose, against the dense solve.
void expect_loop_agreement(Random& random, const Model& tree, const std::vector<std::array<int, 2>>& ends,
                           LoopType type, double tolerance = 1e-9) {
  ClosedCase c;
  c.model = tree;
  const int n = test::moving_joints(tree);
  c.q = test::vector_of(random.numbers(n, 1.5));
  const std::vector<Pose> poses = test::poses_at(tree, c.q);
  for (const auto& [a, b] : ends) c.model.loops.push_back(test::closed_loop(random, type, a, b, poses));
  c.tau = test::vector_of(random.numbers(n, 3));
  c.qd = test::closed_velocity(c.model, c.q, test::vector_of(random.numbers(n, 1)));
  expect_dense_agreement(c, tolerance);
}

// Two arms of `links` links each on the last link of a moving chain of `base` links.
Model two_arms(Random& random, int base, int links) {
  test::TreeOptions options;
  options.links = base + 2 * links;
  options.branches = options.fixed = options.prismatic = options.screws = options.springs = options.massless =
      false;
  Model model = test::random_tree(random, options);
  model.links[base].parent = base - 1;
  model.links[base + links].parent = base - 1;
  return model;
}

TEST_P(RandomLoops, a_loop_may_stand_on_a_moving_root) {
  for (int base = 0; base <= 3; ++base) {
    const Model arms = two_arms(random, base, 3);
    expect_loop_agreement(random, arms, {{base + 2, base + 5}}, LoopType::spherical);
    expect_loop_agreement(random, arms, {{base + 2, base + 5}}, LoopType::revolute);
  }
}

TEST_P(RandomLoops, a_loop_may_end_at_the_ground_an_ancestor_or_the_same_branch) {
  const Model chain = test::serial_chain(8, false);
  expect_loop_agreement(random, chain, {{ground, 7}}, LoopType::spherical);
  expect_loop_agreement(random, chain, {{7, ground}}, LoopType::universal);
  expect_loop_agreement(random, chain, {{1, 7}}, LoopType::spherical);
  expect_loop_agreement(random, chain, {{7, 2}}, LoopType::cylindrical);
}

TEST_P(RandomLoops, loops_may_stand_on_loops) {
  // the second loop's root is a link inside the first, which stands on a moving root
  Model model = two_arms(random, 2, 3);
  for (int arm = 0; arm < 2; ++arm)
    for (int k = 0; k < 3; ++k) {
      Link link = model.links[3];
      link.parent = k == 0 ? 4 : static_cast<int>(model.links.size()) - 1;
      link.joint.dh.alpha = random.between(-3, 3);
      model.links.push_back(link);
    }
  expect_loop_agreement(random, model, {{4, 7}, {10, 13}}, LoopType::spherical, 1e-8);
}

TEST_P(RandomLoops, loops_may_share_joints) {
  const Model chain = test::serial_chain(14, false);
  expect_loop_agreement(random, chain, {{ground, 9}, {5, 13}}, LoopType::spherical, 1e-8);
  expect_loop_agreement(random, chain, {{0, 6}, {3, 10}, {8, 13}}, LoopType::point, 1e-8);
  // one loop inside the other
  expect_loop_agreement(random, chain, {{0, 12}, {3, 9}}, LoopType::spherical, 1e-8);
}

TEST_P(RandomLoops, ground_directions_hold_under_a_moving_root) {
  // one direction of the ground between two links of an arm: the row concerns all joints down to the ground
  const Model chain = test::serial_chain(7, false);
  for (int k = 0; k < 4; ++k) expect_loop_agreement(random, chain, {{2, 6}}, LoopType::point);
}

TEST_P(RandomLoops, ground_directions_mix_with_other_loops) {
  Model chain = test::serial_chain(12, false);
  ClosedCase c;
  c.model = chain;
  c.q = test::vector_of(random.numbers(12, 1.5));
  const auto poses = test::poses_at(chain, c.q);
  c.model.loops.push_back(test::closed_loop(random, LoopType::spherical, 5, 11, poses));
  c.model.loops.push_back(test::closed_loop(random, LoopType::point, 2, 9, poses));
  c.tau = test::vector_of(random.numbers(12, 3));
  c.qd = test::closed_velocity(c.model, c.q, test::vector_of(random.numbers(12, 1)));
  expect_dense_agreement(c, 1e-8);
}

TEST(Loops, may_connect_two_fixed_links_of_moving_bodies) {
  Random random(5);
  Model model = two_arms(random, 1, 3);
  for (int tip : {3, 6}) {
    Link plate;
    plate.parent = tip;
    plate.joint.type = JointType::fixed;
    plate.joint.dh = {0.3, 0.1, 1.2, -0.2, 0.5, 0.3};
    model.links.push_back(plate);
  }
  expect_loop_agreement(random, model, {{7, 8}}, LoopType::universal);
}

TEST(Loops, may_connect_to_a_link_that_is_fixed_to_the_ground) {
  Random random(6);
  Model model = test::serial_chain(7, false);
  Link wall;
  wall.joint.type = JointType::fixed;
  wall.joint.dh = {0.3, 0.1, 1.2, -0.2, 0.5, 0.3};
  model.links.push_back(wall);
  expect_loop_agreement(random, model, {{7, 6}}, LoopType::revolute);
  expect_loop_agreement(random, model, {{6, 7}}, LoopType::prismatic);
}

class FourBarChain : public testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Count, FourBarChain, testing::Values(1, 2, 3, 10, 40));

ClosedCase four_bars(int count, LoopType type) {
  ClosedCase c;
  c.model = test::four_bar_chain(count, type);
  c.q =
      test::vector_of(test::four_bar_chain_pose(count, [](int k) { return 1.2 + 0.1 * std::sin(7.0 * k); }));
  Random random(static_cast<unsigned>(count));
  const int n = 3 * count;
  c.qd = test::closed_velocity(c.model, c.q, test::vector_of(random.numbers(n, 1)));
  c.tau = test::vector_of(random.numbers(n, 1));
  return c;
}

TEST_P(FourBarChain, agrees_with_a_dense_solve) {
  for (const LoopType type :
       {LoopType::revolute, LoopType::spherical, LoopType::universal, LoopType::point}) {
    SCOPED_TRACE(static_cast<int>(type));
    ClosedCase c = four_bars(GetParam(), type);
    if (type == LoopType::universal)
      for (Loop& loop : c.model.loops) loop.axis_b = Vec3<double>::UnitX();
    if (type == LoopType::universal && GetParam() > 10) continue;
    expect_dense_agreement(c, 1e-7);
  }
}

TEST_P(FourBarChain, has_two_independent_rows_a_loop) {
  ClosedCase c = four_bars(GetParam(), LoopType::revolute);
  Evaluate<double> tree(c.model);
  tree.qdd(c.q, c.qd, c.tau);
  EXPECT_EQ(tree.rank(), 2 * GetParam());
  EXPECT_EQ(tree.ws.loop.b.size(), static_cast<std::size_t>(2 * GetParam()));
  // the third row of a spherical cut lies across the plane and is always there by itself
  c.model = test::four_bar_chain(GetParam(), LoopType::spherical);
  Evaluate<double> spatial(c.model);
  spatial.qdd(c.q, c.qd, c.tau);
  EXPECT_EQ(spatial.rank(), 2 * GetParam());
}

TEST(Cost, of_a_chain_of_four_bars_grows_with_its_length) {
  const auto crossings = [](int count) {
    std::size_t sum = 0;
    for (const auto& cluster : Plan<double>(test::four_bar_chain(count)).clusters)
      sum += cluster.crossings.size();
    return sum;
  };
  EXPECT_EQ(crossings(64), 64 * crossings(1));
}

TEST(OverlappingLoops, agree_with_a_dense_solve) {
  for (int count : {1, 2, 5, 12}) {
    SCOPED_TRACE(count);
    ClosedCase c;
    c.model = test::overlapping_loops(count);
    c.q = test::vector_of(test::overlapping_loops_pose(count));
    Random random(static_cast<unsigned>(count));
    c.tau = test::vector_of(random.numbers(static_cast<int>(c.q.size()), 1));
    c.qd = test::closed_velocity(c.model, c.q, c.tau);
    EXPECT_LT((Evaluate<double>(c.model).residual(c.q, c.qd).lpNorm<Eigen::Infinity>()), 1e-14);
    expect_dense_agreement(c, 1e-8);
  }
}

TEST(Cost, of_overlapping_loops_grows_with_their_number) {
  struct Cost {
    std::size_t crossings = 0, entries = 0;
  };
  const auto cost = [](int count) {
    Cost sum;
    for (const FrontPlan& front : Plan<double>(test::overlapping_loops(count)).fronts) {
      sum.crossings += front.crossings.size();
      sum.entries += (front.rows.size() + front.open.size()) * front.rows.size();
    }
    return sum;
  };
  // the ends of the chain have less
  const Cost ten = cost(10), eleven = cost(11), hundred = cost(100);
  EXPECT_EQ(hundred.crossings, ten.crossings + 90 * (eleven.crossings - ten.crossings));
  EXPECT_EQ(hundred.entries, ten.entries + 90 * (eleven.entries - ten.entries));
}

TEST(OverlappingLoops, go_by_fronts_while_all_rows_are_independent) {
  Evaluate<double> tree(test::overlapping_loops(30));
  Vector q = test::vector_of(test::overlapping_loops_pose(30));
  const Vector zero = Vector::Zero(q.size());
  tree.qdd(q, zero, zero);
  EXPECT_TRUE(tree.ws.loop.by_fronts);
  EXPECT_EQ(tree.rank(), 60);
  // stretched out, every bar lies along its links
  q.setZero();
  tree.qdd(q, zero, zero);
  EXPECT_FALSE(tree.ws.loop.by_fronts);
  EXPECT_LT(tree.rank(), 60);
}

TEST(Loops, far_from_the_origin_give_the_same_motion) {
  ClosedCase c = four_bars(2, LoopType::revolute);
  const Vector near = Evaluate<double>(c.model).qdd(c.q, c.qd, c.tau);
  for (double distance : {1e3, 1e6}) {
    c.model.links[0].joint.dh.a += distance;
    c.model.links[1].joint.dh.a += distance;
    Evaluate<double> far(c.model);
    EXPECT_LT(relative_difference(far.qdd(c.q, c.qd, c.tau), near), 1e-9);
    // the bases are 0.3 m apart but for the rounding of their places
    EXPECT_LT(far.residual(c.q, c.qd).lpNorm<Eigen::Infinity>(), 2e-16 * distance + 1e-15);
  }
}

}  // namespace
}  // namespace redysim
