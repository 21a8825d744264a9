#include <gtest/gtest.h>

#include "support/dense.hpp"
#include "support/evaluate.hpp"
#include "support/random_tree.hpp"

namespace redysim {
namespace {

using test::derivative;
using test::Evaluate;
using test::Matrix;
using test::relative_difference;
using test::Vector;

// One random open tree with one random state; the seed is the test's parameter.
class OpenTree : public testing::TestWithParam<unsigned> {
 protected:
  OpenTree()
      : random(GetParam()), model(test::random_tree(random, test::options_of(GetParam()))), tree(model) {
    q = numbers(2);
    qd = numbers(2);
    qdd = numbers(3);
    tau = numbers(5);
  }
  Vector numbers(double size) { return test::vector_of(random.numbers(tree.nv(), size)); }
  Vector zero() const { return Vector::Zero(tree.nv()); }

  test::Random random;
  Model model;
  Evaluate<double> tree;
  Vector q, qd, qdd, tau;
};

INSTANTIATE_TEST_SUITE_P(Seed, OpenTree, testing::Range(0u, test::tree_seeds));

TEST_P(OpenTree, rnea_inverts_aba) {
  const Vector found = tree.qdd(q, qd, tau);
  // errors of qdd come back scaled by M
  const double scale = std::max(1.0, (tree.inertia(q).cwiseAbs() * found.cwiseAbs()).maxCoeff());
  EXPECT_LT((tree.tau(q, qd, found) - tau).lpNorm<Eigen::Infinity>() / scale, 1e-12);
}

TEST_P(OpenTree, aba_inverts_rnea) {
  const Vector needed = tree.tau(q, qd, qdd);
  const Vector difference = tree.inertia(q) * (tree.qdd(q, qd, needed) - qdd);
  EXPECT_LT(difference.lpNorm<Eigen::Infinity>(), 1e-12 * std::max(1.0, needed.lpNorm<Eigen::Infinity>()));
}

TEST_P(OpenTree, inertia_is_symmetric_and_positive_definite) {
  const Matrix M = tree.inertia(q);
  EXPECT_EQ((M - M.transpose()).lpNorm<Eigen::Infinity>(), 0);
  EXPECT_GT(test::eigenvalues(M)[0], 0);
}

TEST_P(OpenTree, inertia_and_bias_make_up_inverse_dynamics) {
  const Vector sum = tree.inertia(q) * qdd + tree.tau(q, qd, zero());
  EXPECT_LT(relative_difference(tree.tau(q, qd, qdd), sum), 1e-13);
}

TEST_P(OpenTree, kinetic_energy_is_half_the_quadratic_form_of_inertia) {
  const double expected = 0.5 * qd.dot(tree.inertia(q) * qd);
  EXPECT_NEAR(tree.kinetic(q, qd), expected, 1e-13 * expected);
}

TEST_P(OpenTree, torque_at_rest_is_the_gradient_of_the_potential) {
  Evaluate<Dual> exact(model);
  Vector gradient(tree.nv());
  for (int i = 0; i < tree.nv(); ++i)
    gradient[i] =
        exact.potential(test::dual(q, Vector::Unit(tree.nv(), i)), test::dual(zero(), zero())).derivative;
  EXPECT_LT(relative_difference(tree.tau(q, zero(), zero()), gradient), 1e-12);
}

// Velocity terms against Christoffel's symbols of M: c_i = (dM_ij/dq_k - 1/2 dM_jk/dq_i) qd_j qd_k; with
// this C, M' - 2C is skew.
TEST_P(OpenTree, velocity_terms_are_christoffels) {
  for (Link& link : model.links)
    link.joint.damping = link.joint.friction = link.joint.static_friction = link.joint.stop_damping = 0;
  for (SpringDamper& spring : model.springs) spring.damping = 0;
  Evaluate<double> conservative(model);
  Evaluate<Dual> exact(model);
  const int n = tree.nv();
  std::vector<Matrix> slope;
  for (int k = 0; k < n; ++k) {
    const auto M = exact.inertia(test::dual(q, Vector::Unit(n, k)));
    slope.emplace_back(n, n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) slope.back()(i, j) = M(i, j).derivative;
  }
  Vector expected = Vector::Zero(n);
  for (int k = 0; k < n; ++k) {
    expected += qd[k] * slope[k] * qd;
    expected[k] -= 0.5 * qd.dot(slope[k] * qd);
  }
  const Vector found = conservative.tau(q, qd, zero()) - conservative.tau(q, zero(), zero());
  EXPECT_LT(relative_difference(found, expected), 1e-12);
}

TEST_P(OpenTree, energy_changes_by_the_power_of_drives_dampers_and_friction) {
  Evaluate<Dual> exact(model);
  const Vector found = tree.qdd(q, qd, tau);
  const auto q_dual = test::dual(q, qd), qd_dual = test::dual(qd, found);
  const double rate = exact.kinetic(q_dual, qd_dual).derivative + exact.potential(q_dual, qd_dual).derivative;
  const double scale = 1 + (tree.inertia(q) * found).cwiseAbs().dot(qd.cwiseAbs());
  EXPECT_NEAR(rate, tree.power(q, qd, tau), 1e-12 * scale);
}

TEST_P(OpenTree, derivatives_by_dual_numbers_agree_with_differences) {
  Evaluate<Dual> exact(model);
  const Vector dq = numbers(1), dqd = numbers(1), dx = numbers(1);
  const double h = 1e-6;
  const auto slope = [h](const Vector& plus, const Vector& minus) -> Vector {
    return (plus - minus) / (2 * h);
  };
  const Vector qdd_slope = slope(tree.qdd(q + h * dq, qd + h * dqd, tau + h * dx),
                                 tree.qdd(q - h * dq, qd - h * dqd, tau - h * dx));
  EXPECT_LT(
      relative_difference(derivative(exact.qdd(test::dual(q, dq), test::dual(qd, dqd), test::dual(tau, dx))),
                          qdd_slope),
      1e-6);
  const Vector tau_slope = slope(tree.tau(q + h * dq, qd + h * dqd, qdd + h * dx),
                                 tree.tau(q - h * dq, qd - h * dqd, qdd - h * dx));
  EXPECT_LT(
      relative_difference(derivative(exact.tau(test::dual(q, dq), test::dual(qd, dqd), test::dual(qdd, dx))),
                          tau_slope),
      1e-7);
  const double kinetic_slope =
      (tree.kinetic(q + h * dq, qd + h * dqd) - tree.kinetic(q - h * dq, qd - h * dqd)) / (2 * h);
  EXPECT_NEAR(exact.kinetic(test::dual(q, dq), test::dual(qd, dqd)).derivative, kinetic_slope,
              1e-7 * (1 + std::abs(tree.kinetic(q, qd))));
  const double potential_slope = (tree.potential(q + h * dq, qd) - tree.potential(q - h * dq, qd)) / (2 * h);
  EXPECT_NEAR(exact.potential(test::dual(q, dq), test::dual(qd, dqd)).derivative, potential_slope,
              1e-7 * (1 + std::abs(tree.potential(q, qd))));
}

TEST_P(OpenTree, the_value_part_of_a_dual_number_is_the_plain_result) {
  Evaluate<Dual> exact(model);
  const auto found = exact.qdd(test::dual(q, qd), test::dual(qd, tau), test::dual(tau, q));
  const Vector plain = tree.qdd(q, qd, tau);
  const Matrix M = tree.inertia(q);
  for (int i = 0; i < tree.nv(); ++i) qdd[i] = found[i].value;
  EXPECT_LT((M * (qdd - plain)).lpNorm<Eigen::Infinity>(),
            1e-12 * std::max(1.0, (M.cwiseAbs() * plain.cwiseAbs()).maxCoeff()));
}

// Momentum of the whole tree along a ground axis, when the first three joints carry it freely.
TEST_P(OpenTree, linear_momentum_is_kept_on_a_frictionless_gantry) {
  constexpr double quarter = 1.5707963267948966;
  Model gantry;
  gantry.gravity.setZero();
  for (int i = 0; i < 3; ++i) {
    Link carriage;
    carriage.parent = i - 1;
    carriage.joint.type = JointType::prismatic;
    carriage.mass = 1;
    if (i == 1) carriage.joint.dh.alpha = quarter;
    if (i == 2) carriage.joint.dh = {quarter, 0, quarter, 0, 0, 0};  // three skew axes at right angles
    gantry.links.push_back(carriage);
  }
  Model moved = model;
  for (Link& link : moved.links) link.parent = link.parent == ground ? 2 : link.parent + 3;
  for (SpringDamper& spring : moved.springs) {
    // inner springs only: the ground must not pull
    spring.link_a = spring.link_a == ground ? 3 : spring.link_a + 3;
    spring.link_b = spring.link_b == ground ? 3 : spring.link_b + 3;
  }
  gantry.links.insert(gantry.links.end(), moved.links.begin(), moved.links.end());
  gantry.springs = moved.springs;
  Evaluate<double> free(gantry);
  Evaluate<Dual> exact(gantry);
  const int n = free.nv();
  const Vector x = test::vector_of(random.numbers(n, 1)), v = test::vector_of(random.numbers(n, 1));
  Vector force = test::vector_of(random.numbers(n, 3));
  force.head(3).setZero();
  const auto M = exact.inertia(test::dual(x, v));
  const auto momentum = (M * test::dual(v, free.qdd(x, v, force))).eval();
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(momentum[i].derivative, 0, 1e-10 * (1 + std::abs(momentum[i].value))) << i;
}

TEST_P(OpenTree, order_of_the_links_does_not_matter) {
  // a random order in which parents still come first
  const int n = static_cast<int>(model.links.size());
  std::vector<int> place(n, -1), order;
  while (static_cast<int>(order.size()) < n) {
    const int i = random.index(n);
    if (place[i] >= 0 || (model.links[i].parent != ground && place[model.links[i].parent] < 0)) continue;
    place[i] = static_cast<int>(order.size());
    order.push_back(i);
  }
  Model shuffled = model;
  const auto moved = [&place](int link) { return link == ground ? ground : place[link]; };
  for (int i = 0; i < n; ++i) {
    shuffled.links[i] = model.links[order[i]];
    shuffled.links[i].parent = moved(shuffled.links[i].parent);
  }
  for (SpringDamper& spring : shuffled.springs) {
    spring.link_a = moved(spring.link_a);
    spring.link_b = moved(spring.link_b);
  }
  Evaluate<double> other(shuffled);
  std::vector<int> joint_of;  // joint of the shuffled model -> joint of the first
  for (const auto& joint : other.plan.joints) {
    const int link = order[joint.link];
    for (std::size_t j = 0; j < tree.plan.joints.size(); ++j)
      if (tree.plan.joints[j].link == link) joint_of.push_back(static_cast<int>(j));
  }
  const auto in_other = [&joint_of](const Vector& v) {
    Vector out(v.size());
    for (Eigen::Index i = 0; i < v.size(); ++i) out[i] = v[joint_of[i]];
    return out;
  };
  EXPECT_LT(relative_difference(other.tau(in_other(q), in_other(qd), in_other(qdd)),
                                in_other(tree.tau(q, qd, qdd))),
            1e-13);
}

// Every body cut in two, the halves joined by a fixed joint in a frame of its own.
TEST_P(OpenTree, fixed_joints_make_one_body_of_two) {
  Model split;
  split.gravity = model.gravity;
  std::vector<int> place;
  for (const Link& whole : model.links) {
    place.push_back(static_cast<int>(split.links.size()));
    Link first = whole;
    first.parent = whole.parent == ground ? ground : place[whole.parent];
    // two thirds stay, the rest goes to the fixed link: same com and the same share of the inertia
    const double share = whole.mass > 0 ? 2.0 / 3 : 1;
    first.mass = share * whole.mass;
    for (double& entry : first.inertia) entry *= share;
    split.links.push_back(first);
    if (share == 1) continue;
    Link second;
    second.parent = place.back();
    second.joint.type = JointType::fixed;
    second.joint.dh = {random.between(-3, 3), random.between(-1, 1), random.between(-3, 3),
                       random.between(-1, 1), random.between(-3, 3), random.between(-1, 1)};
    const Pose frame = inverse(pose_of(second.joint.dh));
    second.mass = (1 - share) * whole.mass;
    second.com = frame.rotation * whole.com + frame.position;
    Mat3<double> I;
    const auto& given = whole.inertia;
    I << given[0], given[3], given[4], given[3], given[1], given[5], given[4], given[5], given[2];
    I = (1 - share) * frame.rotation * I * frame.rotation.transpose();
    second.inertia = {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)};
    split.links.push_back(second);
  }
  split.springs = model.springs;
  for (SpringDamper& spring : split.springs) {
    if (spring.link_a != ground) spring.link_a = place[spring.link_a];
    if (spring.link_b != ground) spring.link_b = place[spring.link_b];
  }
  Evaluate<double> other(split);
  ASSERT_EQ(other.nv(), tree.nv());
  EXPECT_LT(relative_difference(other.tau(q, qd, qdd), tree.tau(q, qd, qdd)), 1e-12);
}

TEST_P(OpenTree, a_fixed_base_link_turns_the_whole_scene) {
  Link base;
  base.joint.type = JointType::fixed;
  base.joint.dh = {0.3, -0.2, 0.7, 0.4, -1.1, 0.5};
  const Pose pose = pose_of(base.joint.dh);
  Model moved = model;
  moved.gravity = pose.rotation * model.gravity;
  moved.links.insert(moved.links.begin(), base);
  for (std::size_t i = 1; i < moved.links.size(); ++i) moved.links[i].parent += 1;
  for (SpringDamper& spring : moved.springs) {
    spring.link_a += 1;  // ground becomes the base link
    spring.link_b += 1;
  }
  Evaluate<double> other(moved);
  EXPECT_LT(relative_difference(other.tau(q, qd, qdd), tree.tau(q, qd, qdd)), 1e-12);
}

TEST_P(OpenTree, a_base_far_away_changes_nothing) {
  Model far = model;
  Link base;
  base.joint.type = JointType::fixed;
  base.joint.dh.a = 1e4;
  base.joint.dh.d = -1e4;
  far.links.insert(far.links.begin(), base);
  for (std::size_t i = 1; i < far.links.size(); ++i) far.links[i].parent += 1;
  for (SpringDamper& spring : far.springs) {
    spring.link_a += 1;
    spring.link_b += 1;
  }
  Evaluate<double> other(far);
  // only springs and the first frames look at absolute positions
  EXPECT_LT(relative_difference(other.tau(q, qd, qdd), tree.tau(q, qd, qdd)), 1e-9);
}

// Their common normal is 1e5 times as far away as the bodies; once from the DH parameters, once across a
// fixed link.
TEST_P(OpenTree, nearly_parallel_axes_keep_all_digits) {
  Model tilted = model, across = model;
  tilted.springs.clear();
  across.springs.clear();
  across.links.clear();
  std::vector<int> place;
  for (Link& link : tilted.links) {
    Pose pose = pose_of(link.joint.dh);
    if (random.chance(0.5)) {
      const double tilt = random.between(1e-6, 1e-5);
      pose = pose_of({random.between(-3, 3), 0, tilt, 0, random.between(-3, 3), 0});
      pose.position = random.vector(0.5);
    }
    Link foot, copy = link;
    foot.joint.type = JointType::fixed;
    foot.joint.dh = {0.3, -0.2, 0.7, 0.4, -1.1, 0.5};
    foot.parent = link.parent == ground ? ground : place[link.parent];
    copy.parent = static_cast<int>(across.links.size());
    place.push_back(copy.parent + 1);
    link.joint.dh = dh_of(pose);
    copy.joint.dh = dh_of(inverse(pose_of(foot.joint.dh)) * pose);
    across.links.insert(across.links.end(), {foot, copy});
  }
  for (const Model& variant : {tilted, across}) {
    Evaluate<double> other(variant);
    const Vector found = other.qdd(q, qd, tau);
    const double scale = std::max(1.0, (other.inertia(q).cwiseAbs() * found.cwiseAbs()).maxCoeff());
    EXPECT_LT((other.tau(q, qd, found) - tau).lpNorm<Eigen::Infinity>() / scale, 1e-12);
  }
  // the parameters themselves are known to the rounding of the distance
  EXPECT_LT(
      relative_difference(Evaluate<double>(across).tau(q, qd, qdd), Evaluate<double>(tilted).tau(q, qd, qdd)),
      1e-8);
}

TEST_P(OpenTree, update_takes_over_changed_parameters) {
  model.fmu.tunable = {"any.friction", "any.lower"};
  tree = Evaluate<double>(model);
  Model changed = model;
  for (Link& link : changed.links) {
    if (link.mass > 0) test::give_inertia(random, link);
    link.joint.damping += 0.3;
    if (random.chance(0.5)) test::give_resistance(random, link.joint);
    link.joint.armature = random.chance(0.5) ? 0.2 : 0;
  }
  changed.gravity = {1, 2, 3};
  tree.plan.update(parameters_of(changed));
  Evaluate<double> fresh(changed);
  EXPECT_EQ(relative_difference(tree.qdd(q, qd, tau), fresh.qdd(q, qd, tau)), 0);
}

}  // namespace
}  // namespace redysim
