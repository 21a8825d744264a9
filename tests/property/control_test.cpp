#include "integrate/control/control.hpp"

#include <gtest/gtest.h>

#include "integrate/system/dense_jacobian.hpp"
#include "support/random_loops.hpp"

// Control laws and trajectories on random trees with random drives: what the equations of each law say.

namespace redysim {
namespace {

using test::Evaluate;
using test::Random;
using test::relative_difference;
using test::Vector;

Trajectory random_trajectory(Random& random, int link) {
  Trajectory trajectory;
  trajectory.link = link;
  trajectory.begin = random.between(-1, 0);
  trajectory.end = random.between(1, 2);
  trajectory.from = random.between(-1, 1);
  trajectory.to = random.between(-1, 1);
  trajectory.kind = random.chance(0.5) ? Trajectory::Kind::cycloid : Trajectory::Kind::polynomials;
  trajectory.pieces = {{trajectory.begin, random.numbers(5, 0.5)}};
  return trajectory;
}

// Random drives, trajectories of every second joint, and a law for some of those with drive torque.
Model controlled(Random& random, Model model, Law law, bool all) {
  constexpr Drive drives[] = {Drive::torque, Drive::torque, Drive::motion, Drive::locked, Drive::free};
  model.controller.law = law;
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    Joint& joint = model.links[i].joint;
    if (joint.type == JointType::fixed) continue;
    joint.drive = drives[random.index(all ? 4 : 5)];
    joint.q0 = random.between(-1, 1);
    const int link = static_cast<int>(i);
    if (random.chance(0.5)) model.trajectories.push_back(random_trajectory(random, link));
    if (joint.drive != Drive::torque || (!all && random.chance(0.3))) continue;
    model.controller.joints.push_back(
        {link, random.between(1, 50), random.between(1, 10), random.between(-1, 1)});
  }
  return model;
}

Model without_contacts_and_stops(Model model) {
  model.contacts.clear();
  for (Link& link : model.links) link.joint.stop_stiffness = 0;
  return model;
}

// A system at a time, with random states and inputs.
struct Scene {
  Model model;
  Plan<double> plan;
  System system;
  double time;
  std::vector<double> y, ydot;
  Vector qdd, tau;

  Scene(Random& random, const Model& given)
      : model(given), plan(model), system(plan, true, &model), time(random.between(0, 1)) {
    y = random.numbers(system.size(), 1);
    ydot = y;
    for (int i = 0; i < plan.nv; ++i) {
      if (!plan.joints[i].prescribed)
        system.tau(i) =
            model.links[plan.joints[i].link].joint.drive == Drive::torque ? random.between(-2, 2) : 0;
      else if (model.links[plan.joints[i].link].joint.drive == Drive::motion)
        system.set_motion(time, i, random.between(-1, 1), random.between(-1, 1), random.between(-1, 1));
    }
    system.enter_phases(time);
    update();
  }
  void update() {
    qdd.resize(plan.nv);
    tau.resize(plan.nv);
    system.right_hand_side(time, y.data(), ydot.data());
    system.accelerations(time, y.data(), qdd.data());
    const auto at = system.coordinates(time, y.data());
    system.drive_forces(at, qdd.data(), tau.data());
  }
  Vector q() { return Eigen::Map<const Vector>(system.coordinates(time, y.data()).q, plan.nv); }
  Vector qd() { return Eigen::Map<const Vector>(system.coordinates(time, y.data()).qd, plan.nv); }
  int joint(std::size_t k) const { return plan.carrier[model.controller.joints[k].link]; }
  // PD control and what is added, of a controlled joint
  double pd(std::size_t k) {
    const ControlledJoint& gains = model.controller.joints[k];
    double wanted = gains.target, rate = 0;
    for (const Trajectory& own : model.trajectories)
      if (own.link == gains.link) {
        const JointMotion motion = motion_at(own, phase_at(own, time), time);
        wanted = motion.q;
        rate = motion.qd;
      }
    const int i = joint(k);
    return system.inputs()[i] + gains.kp * (wanted - q()[i]) + gains.kd * (rate - qd()[i]);
  }
};

class Controlled : public testing::TestWithParam<unsigned> {
 protected:
  Random random{GetParam()};
  Model tree(Law law, bool all = false) {
    return controlled(random, random_tree(random, test::options_of(GetParam())), law, all);
  }
};

INSTANTIATE_TEST_SUITE_P(Seed, Controlled, testing::Range(0u, test::tree_seeds));

TEST_P(Controlled, forces_found_are_those_that_move_the_open_plant_so) {
  for (Law law : {Law::pd, Law::gravity_compensation, Law::computed_torque}) {
    Scene scene(random, tree(law));
    Evaluate<double> open(scene.model);
    EXPECT_LT(relative_difference(open.tau(scene.q(), scene.qd(), scene.qdd), scene.tau), 1e-9);
  }
}

TEST_P(Controlled, pd_gives_its_two_terms_and_what_is_added) {
  Scene scene(random, tree(Law::pd));
  for (std::size_t k = 0; k < scene.model.controller.joints.size(); ++k)
    EXPECT_NEAR(scene.tau[scene.joint(k)], scene.pd(k), 1e-11);
}

TEST_P(Controlled, gravity_compensation_does_not_know_contacts_and_stops) {
  Scene scene(random, tree(Law::gravity_compensation));
  Evaluate<double> known(without_contacts_and_stops(scene.model));
  const Vector at_rest = Vector::Zero(scene.plan.nv), wanted = known.tau(scene.q(), at_rest, at_rest);
  for (std::size_t k = 0; k < scene.model.controller.joints.size(); ++k) {
    const double expected = scene.pd(k) + wanted[scene.joint(k)];
    EXPECT_NEAR(scene.tau[scene.joint(k)], expected, 1e-9 * std::max(1.0, std::abs(expected)));
  }
}

TEST_P(Controlled, gravity_compensation_holds_any_pose_at_rest) {
  Model model = without_contacts_and_stops(tree(Law::gravity_compensation, true));
  model.trajectories.clear();
  Scene scene(random, model);
  // at the target and at rest nothing moves
  std::fill(scene.system.inputs().begin(), scene.system.inputs().end(), 0.0);
  for (int i = 0; i < scene.plan.nv; ++i)
    if (scene.plan.joints[i].prescribed) scene.system.set_motion(scene.time, i, 0.3, 0, 0);
  for (std::size_t k = 0; k < model.controller.joints.size(); ++k)
    for (int s = 0; s < scene.system.simple(); ++s)
      if (scene.system.joint_of(s) == scene.joint(k)) {
        scene.y[s] = model.controller.joints[k].target;
        scene.y[scene.system.layout().qd[s]] = 0;
      }
  scene.update();
  EXPECT_LT(scene.qdd.lpNorm<Eigen::Infinity>(), 1e-8);
}

TEST_P(Controlled, feed_forward_alone_keeps_to_the_reference) {
  Scene scene(random, tree(Law::feed_forward, true));
  for (std::size_t k = 0; k < scene.model.controller.joints.size(); ++k) scene.system.tau(scene.joint(k)) = 0;
  for (int s = 0; s < scene.system.simple(); ++s) {
    const JointMotion wanted = scene.system.reference(scene.system.joint_of(s), scene.time);
    scene.y[s] = wanted.q;
    scene.y[scene.system.layout().qd[s]] = wanted.qd;
  }
  scene.update();
  for (int s = 0; s < scene.system.simple(); ++s) {
    const int i = scene.system.joint_of(s);
    const double wanted = scene.system.reference(i, scene.time).qdd;
    EXPECT_NEAR(scene.qdd[i], wanted, 1e-7 * std::max(1.0, scene.qdd.lpNorm<Eigen::Infinity>()));
  }
}

// e'' + kd e' + kp e = 0 for the controlled joints, whatever the others do.
void expect_error_dynamics(Scene& scene, double tolerance) {
  for (std::size_t k = 0; k < scene.model.controller.joints.size(); ++k) scene.system.tau(scene.joint(k)) = 0;
  scene.update();
  const Vector q = scene.q(), qd = scene.qd();
  for (std::size_t k = 0; k < scene.model.controller.joints.size(); ++k) {
    const int i = scene.joint(k);
    const ControlledJoint& gains = scene.model.controller.joints[k];
    const JointMotion wanted = scene.system.reference(i, scene.time);
    const double e2 = wanted.qdd - scene.qdd[i], e1 = wanted.qd - qd[i], e = wanted.q - q[i];
    EXPECT_NEAR(e2 + gains.kd * e1 + gains.kp * e, 0,
                tolerance * std::max(100.0, scene.qdd.lpNorm<Eigen::Infinity>()));
  }
}

TEST_P(Controlled, computed_torque_leaves_linear_error_dynamics) {
  Scene scene(random, tree(Law::computed_torque));
  expect_error_dynamics(scene, 1e-9);
}

TEST_P(Controlled, computed_torque_does_so_in_closed_loops) {
  test::TreeOptions options;
  options.links = 9;
  options.massless = options.springs = options.fixed = options.branches = false;
  Model model = random_tree(random, options);
  for (Link& link : model.links) link.joint.drive = Drive::free;
  const Vector q = test::vector_of(random.numbers(9, 1));
  model.loops.push_back(test::closed_loop(random, LoopType::point, 8, ground, test::poses_at(model, q)));
  // two driven joints, fewer than the freedom
  for (int link : {0, 4}) {
    model.links[link].joint.drive = Drive::torque;
    model.controller.joints.push_back({link, 20, 5, 0.3});
    model.trajectories.push_back(random_trajectory(random, link));
  }
  model.controller.law = Law::computed_torque;
  const Vector qd = test::closed_velocity(model, q, test::vector_of(random.numbers(9, 1)));
  Scene scene(random, model);
  std::copy_n(q.data(), 9, scene.y.begin());
  std::copy_n(qd.data(), 9, scene.y.begin() + 9);
  expect_error_dynamics(scene, 1e-7);
}

TEST_P(Controlled, a_trajectory_moves_like_the_motion_that_it_is_at_the_time) {
  Model model = tree(Law::pd);
  model.controller = Controller();
  Scene guided(random, model);
  Model without = model;
  without.trajectories.clear();
  System system(guided.plan, true, &without);
  for (int i = 0; i < guided.plan.nv; ++i) {
    if (!guided.plan.joints[i].prescribed)
      system.tau(i) = guided.system.tau(i);
    else
      system.set_motion(guided.time, i, guided.q()[i], guided.qd()[i], guided.qdd[i]);
  }
  Vector qdd(guided.plan.nv);
  system.accelerations(guided.time, guided.y.data(), qdd.data());
  EXPECT_LT(relative_difference(qdd, guided.qdd), 1e-10);
}

TEST_P(Controlled, power_of_controlled_drives_is_the_rate_of_energy) {
  for (Law law : {Law::pd, Law::gravity_compensation, Law::computed_torque}) {
    Scene scene(random, tree(law));
    Evaluate<Dual> exact(scene.model);
    const auto q = test::dual(scene.q(), scene.qd()), qd = test::dual(scene.qd(), scene.qdd);
    const Dual energy = exact.kinetic(q, qd) + exact.potential(q, qd);
    const double power = scene.ydot.back();
    EXPECT_NEAR(power, energy.derivative,
                1e-9 * std::max(1.0, std::abs(energy.derivative) + std::abs(power)));
  }
}

TEST_P(Controlled, the_jacobian_knows_the_law) {
  for (Law law : {Law::pd, Law::gravity_compensation, Law::feed_forward, Law::computed_torque}) {
    Scene scene(random, tree(law, law == Law::feed_forward));
    System& system = scene.system;
    const int size = system.size();
    if (size == 1) continue;
    // gains are exact, a model's part is differences of first order
    const double tolerance = law == Law::gravity_compensation || law == Law::computed_torque ? 1e-4 : 3e-6;
    DenseJacobian jacobian(system);
    std::vector<double> matrix(static_cast<std::size_t>(size * size)), up(scene.y), down(scene.y), y(scene.y);
    ASSERT_EQ(jacobian.evaluate(scene.time, y.data(), matrix.data()), Status::ok);
    for (int j = 0; j < size; ++j) {
      constexpr double h = 1e-6;
      y[j] = scene.y[j] + h;
      system.right_hand_side(scene.time, y.data(), up.data());
      y[j] = scene.y[j] - h;
      system.right_hand_side(scene.time, y.data(), down.data());
      y[j] = scene.y[j];
      double scale = 1;
      for (int i = 0; i < size; ++i)
        scale = std::max({scale, std::abs(matrix[j * size + i]), 1e-2 * std::abs(up[i])});
      // the power of prescribed drives is derived at held forces
      for (int i = 0; i < (scene.plan.prescribed_count > 0 ? size - 1 : size); ++i)
        EXPECT_NEAR(matrix[j * size + i], (up[i] - down[i]) / (2 * h), tolerance * scale)
            << "law " << static_cast<int>(law) << " row " << i << " column " << j << " of " << size;
    }
  }
}

}  // namespace
}  // namespace redysim
