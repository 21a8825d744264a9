#include <gtest/gtest.h>

#include "dynamics/assembly/freedom.hpp"
#include "dynamics/energy.hpp"
#include "dynamics/input_layout.hpp"
#include "dynamics/joint_elimination.hpp"
#include "support/random_loops.hpp"

// Every mix of drives is the same plant: what a prescribed motion needs as a force gives that motion when it
// is applied as a torque.

namespace redysim {
namespace {

using test::Evaluate;
using test::Random;
using test::relative_difference;
using test::Vector;

constexpr Drive all_drives[] = {Drive::torque, Drive::motion, Drive::locked, Drive::free};

// The same tree with a random drive at every joint.
Model with_random_drives(Random& random, Model model) {
  for (Link& link : model.links) link.joint.drive = all_drives[random.index(4)];
  return model;
}

// Forces of all drives after forward dynamics.
Vector drive_forces(Evaluate<double>& mixed, const Vector& q, const Vector& qd, const Vector& qdd,
                    const Vector& inputs) {
  Vector tau = inputs.head(mixed.nv());
  for (Eigen::Index i = 0; i < tau.size(); ++i)
    if (mixed.plan.joints[i].prescribed)
      tau[i] = prescribed_force(mixed.plan, mixed.ws, static_cast<int>(i), q.data(), qd.data(), qdd.data());
  return tau;
}

// Frames on random links, each a port.
void add_ports(Random& random, Model& model) {
  for (int k = 0; k < 3; ++k) {
    Frame frame;
    frame.name = "frame" + std::to_string(k);
    frame.link = random.index(static_cast<int>(model.links.size()));
    frame.position = random.vector(0.5);
    frame.rotation = Eigen::AngleAxisd(random.between(-3, 3), random.direction()).toRotationMatrix();
    frame.port = random.chance(0.5) ? Frame::Port::ground_axes : Frame::Port::frame_axes;
    model.frames.push_back(frame);
  }
}

class Drives : public testing::TestWithParam<unsigned> {
 protected:
  Random random{GetParam()};
  Vector numbers(int count, double size) { return test::vector_of(random.numbers(count, size)); }
};

INSTANTIATE_TEST_SUITE_P(Seed, Drives, testing::Range(0u, test::tree_seeds));

TEST_P(Drives, any_mix_agrees_with_inverse_and_forward_dynamics) {
  const Model model = random_tree(random, test::options_of(GetParam()));
  Evaluate<double> open(model);
  const int n = open.nv();
  for (int mix = 0; mix < 5; ++mix) {
    Evaluate<double> mixed(with_random_drives(random, model));
    const Vector q = numbers(n, 3), qd = numbers(n, 2), inputs = numbers(n, 5);
    const Vector qdd = mixed.qdd(q, qd, inputs);
    const Vector tau = drive_forces(mixed, q, qd, qdd, inputs);
    for (int i = 0; i < n; ++i)
      if (mixed.plan.joints[i].prescribed) {
        EXPECT_EQ(qdd[i], inputs[i]);
      }
    EXPECT_LT(relative_difference(open.tau(q, qd, qdd), tau), 1e-10);
    EXPECT_LT(relative_difference(open.qdd(q, qd, tau), qdd), 1e-8);
  }
}

TEST_P(Drives, with_every_joint_prescribed_forward_dynamics_is_inverse_dynamics) {
  Model model = random_tree(random, test::options_of(GetParam()));
  Evaluate<double> open(model);
  for (Link& link : model.links) link.joint.drive = Drive::motion;
  Evaluate<double> inverse(model);
  const int n = open.nv();
  const Vector q = numbers(n, 3), qd = numbers(n, 2), wanted = numbers(n, 5);
  const Vector qdd = inverse.qdd(q, qd, wanted);
  EXPECT_EQ(qdd, wanted);
  EXPECT_LT(relative_difference(drive_forces(inverse, q, qd, qdd, wanted), open.tau(q, qd, wanted)), 1e-12);
}

TEST_P(Drives, a_port_acts_as_its_lever_at_the_joints) {
  Model model = random_tree(random, test::options_of(GetParam()));
  Evaluate<double> open(model);
  add_ports(random, model);
  Evaluate<double> pushed(model);
  const int n = open.nv();
  const Vector q = numbers(n, 3), qd = numbers(n, 2), tau = numbers(n, 5);
  const InputLayout layout(pushed.plan);
  const Vector wrenches = numbers(layout.port_wrench.size(), 5);
  Vector inputs(layout.recursion_size());
  inputs << tau, wrenches;
  // J^T f by differences of poses, which are products of DH displacements
  Vector lever = Vector::Zero(n);
  const double h = 1e-6;
  for (Eigen::Index j = 0; j < n; ++j) {
    const std::vector<Pose> before = test::poses_at(model, q - h * Vector::Unit(n, j)),
                            at = test::poses_at(model, q),
                            after = test::poses_at(model, q + h * Vector::Unit(n, j));
    for (std::size_t k = 0; k < pushed.plan.ports.size(); ++k) {
      const Frame& frame = model.frames[pushed.plan.ports[k].frame];
      const auto origin = [&frame](const std::vector<Pose>& poses) -> Vec3<double> {
        return poses[frame.link].rotation * frame.position + poses[frame.link].position;
      };
      const Mat3<double> turn =
          (after[frame.link].rotation - before[frame.link].rotation) * at[frame.link].rotation.transpose();
      const Mat3<double> axes = frame.port == Frame::Port::ground_axes
                                    ? Mat3<double>(Mat3<double>::Identity())
                                    : Mat3<double>(at[frame.link].rotation * frame.rotation);
      const double* wrench = layout.port_wrench.of(inputs.data(), static_cast<int>(k));
      const Vec3<double> moment = axes * Vec3<double>(wrench), force = axes * Vec3<double>(wrench + 3);
      lever[j] += (force.dot(origin(after) - origin(before)) +
                   moment.dot(Vec3<double>(turn(2, 1), turn(0, 2), turn(1, 0)))) /
                  (2 * h);
    }
  }
  // what the drives must add to keep the same accelerations
  const Vector qdd = pushed.qdd(q, qd, inputs);
  EXPECT_LT(relative_difference(open.tau(q, qd, qdd), tau + lever), 1e-7);
}

TEST_P(Drives, power_of_drives_dampers_and_ports_is_the_rate_of_energy) {
  Model model = random_tree(random, test::options_of(GetParam()));
  add_ports(random, model);
  model = with_random_drives(random, model);
  Evaluate<double> mixed(model);
  Evaluate<Dual> exact(model);
  const InputLayout layout(mixed.plan);
  const int n = mixed.nv();
  const Vector q = numbers(n, 3), qd = numbers(n, 2), inputs = numbers(layout.recursion_size(), 5);
  const Vector qdd = mixed.qdd(q, qd, inputs);
  const Vector tau = drive_forces(mixed, q, qd, qdd, inputs);
  double power = external_power(mixed.plan, mixed.ws, q.data(), qd.data(), tau.data());
  for (int k = 0; k < layout.port_wrench.count; ++k)
    power += port_power(mixed.plan, mixed.ws, mixed.plan.ports[k], qd.data(),
                        layout.port_wrench.of(inputs.data(), k));
  const auto q_along = test::dual(q, qd), qd_along = test::dual(qd, qdd);
  const Dual energy = exact.kinetic(q_along, qd_along) + exact.potential(q_along, qd_along);
  EXPECT_NEAR(power, energy.derivative, 1e-9 * std::max(1.0, std::abs(energy.derivative) + std::abs(power)));
}

TEST_P(Drives, any_mix_in_closed_loops_is_the_same_plant) {
  test::TreeOptions options;
  options.links = 10;
  options.massless = options.springs = false;
  Model model = random_tree(random, options);
  const int n = test::moving_joints(model);
  const Vector q = numbers(n, 2);
  const std::vector<Pose> poses = test::poses_at(model, q);
  const Plan<double> tree(model);
  const auto joint = [&tree](int link) { return link == ground ? ground : tree.carrier[link]; };
  while (model.loops.size() < 2) {
    const int a = random.index(options.links + 1) - 1, b = random.index(options.links + 1) - 1;
    if (joint(a) == joint(b)) continue;
    model.loops.push_back(
        test::closed_loop(random, random.chance(0.5) ? LoopType::point : LoopType::universal, a, b, poses));
  }
  const Vector qd = test::closed_velocity(model, q, numbers(n, 2)), tau = numbers(n, 5);
  Evaluate<double> closed(model);
  const Vector qdd = closed.qdd(q, qd, tau);
  for (int mix = 0; mix < 5; ++mix) {
    const Model other = with_random_drives(random, model);
    const Freedom found = freedom(other, Plan<double>(other), q.data());
    Evaluate<double> mixed(other);
    Vector inputs = tau;
    for (int i = 0; i < n; ++i)
      if (mixed.plan.joints[i].prescribed) inputs[i] = qdd[i];
    const Vector again = mixed.qdd(q, qd, inputs);
    EXPECT_LT(relative_difference(again, qdd), 1e-7);
    EXPECT_EQ(found.motions, mixed.plan.prescribed_count);
    // motions that depend on each other share their load in another way
    if (found.surplus > 0) continue;
    EXPECT_LT(relative_difference(drive_forces(mixed, q, qd, again, inputs), tau), 1e-6);
  }
}

}  // namespace
}  // namespace redysim
