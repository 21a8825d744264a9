#include "integrate/actuator/actuators.hpp"

#include <gtest/gtest.h>

#include "integrate/system/dense_jacobian.hpp"
#include "integrate/system/start.hpp"
#include "support/random_loops.hpp"

// Random actuators on random trees, with and without a controller: the equations of the law, written again,
// and the derivatives and the energy of the whole.

namespace redysim {
namespace {

using test::Evaluate;
using test::Random;
using test::relative_difference;
using test::Vector;

Actuator random_actuator(Random& random, int link) {
  Actuator actuator;
  actuator.link = link;
  actuator.gear_ratio = (random.chance(0.3) ? -1 : 1) * random.between(0.5, 20);
  if (random.chance(0.6)) {
    actuator.rotor_inertia = random.between(0.01, 0.1);
    actuator.stiffness = random.between(5, 50);
    actuator.damping = random.between(0, 3);
    if (random.chance(0.5)) actuator.backlash = random.between(0.1, 0.5);
    actuator.backlash_width = 0.5 * actuator.backlash;
  }
  if (random.chance(0.6)) actuator.torque_limit = random.between(1, 5);
  actuator.torque_limit_width = 0.8 * actuator.torque_limit;
  if (random.chance(0.5)) actuator.speed_limit = random.between(0.5, 2);
  actuator.speed_limit_width = 0.8 * actuator.speed_limit;
  if (random.chance(0.4)) actuator.time_constant = random.between(0.1, 1);
  if (random.chance(0.4)) {
    actuator.resistance = random.between(0.5, 2);
    actuator.torque_constant = random.between(0.1, 1);
    if (random.chance(0.6)) actuator.inductance = random.between(0.1, 1);
  }
  return actuator;
}

Model actuated(Random& random, Model model, Law law, double motions) {
  model.controller.law = law;
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    Joint& joint = model.links[i].joint;
    if (joint.type == JointType::fixed) continue;
    const int link = static_cast<int>(i);
    joint.drive = random.chance(motions) ? Drive::motion : Drive::torque;
    if (joint.drive == Drive::motion) continue;
    if (random.chance(0.7)) model.actuators.push_back(random_actuator(random, link));
    if (law != Law::none && random.chance(0.7))
      model.controller.joints.push_back(
          {link, random.between(1, 10), random.between(1, 3), random.between(-1, 1)});
  }
  return model;
}

// A system with random states and inputs.
struct Scene {
  Model model;
  Plan<double> plan;
  System system;
  std::vector<double> y, ydot;

  Scene(Random& random, const Model& given) : model(given), plan(model), system(plan, true, &model) {
    y = random.numbers(system.size(), 1);
    ydot = y;
    // motors within a turn of their joints, so that twists are of the size of backlashes
    for (int k = 0; system.actuators() && k < system.actuators()->size(); ++k) {
      const Actuators::Places place = system.actuators()->places(k);
      if (place.motor_q < 0) continue;
      y[place.motor_q] *= system.actuators()->law(k).gear_ratio;
      y[place.motor_qd] *= system.actuators()->law(k).gear_ratio;
    }
    for (int i = 0; i < plan.nv; ++i)
      if (plan.joints[i].prescribed)
        system.set_motion(0, i, random.between(-1, 1), random.between(-1, 1), random.between(-1, 1));
      else
        system.tau(i) = random.between(-4, 4);
    system.right_hand_side(0, y.data(), ydot.data());
  }
};

class Actuated : public testing::TestWithParam<unsigned> {
 protected:
  Random random{GetParam()};
  Model tree(Law law, double motions = 0.2) {
    return actuated(random, random_tree(random, test::options_of(GetParam())), law, motions);
  }
};

INSTANTIATE_TEST_SUITE_P(Seed, Actuated, testing::Range(0u, test::tree_seeds));

double onset(double depth, double width) {
  if (depth <= 0) return 0;
  const double u = std::min(depth / width, 1.0);
  return width * (u * u * u - 0.5 * u * u * u * u) + std::max(0.0, depth - width);
}

// As docs/actuators.md defines it.
TEST_P(Actuated, joints_and_motors_follow_the_law) {
  Scene scene(random, tree(Law::none));
  if (!scene.system.actuators()) return;
  const StateLayout& layout = scene.system.layout();
  Vector tau = Eigen::Map<const Vector>(scene.system.inputs().data(), scene.plan.nv);
  for (int k = 0; k < scene.system.actuators()->size(); ++k) {
    const Actuators& actuators = *scene.system.actuators();
    const Actuator& a = actuators.law(k);
    const Actuators::Places place = actuators.places(k);
    int state = 0;
    while (scene.system.joint_of(state) != actuators.joint(k)) ++state;
    const double N = a.gear_ratio, q = scene.y[layout.q[state]], qd = scene.y[layout.qd[state]];
    double& torque = tau[actuators.joint(k)];
    if (a.time_constant > 0) {
      EXPECT_NEAR(scene.ydot[place.lagged], (torque - scene.y[place.lagged]) / a.time_constant, 1e-12);
      torque = scene.y[place.lagged];
    }
    const double motor_qd = a.is_elastic() ? scene.y[place.motor_qd] : N * qd;
    if (a.is_electric()) {
      double current = (torque - a.torque_constant * motor_qd) / a.resistance;
      if (a.inductance > 0) {
        const double wanted = current;
        current = scene.y[place.current];
        EXPECT_NEAR(scene.ydot[place.current], a.resistance / a.inductance * (wanted - current), 1e-11);
      }
      torque = N * a.torque_constant * current;
    }
    if (a.limits_torque()) {
      const double w = a.torque_limit_width, L = a.torque_limit;
      torque = torque - onset(torque - L + w / 2, w) + onset(-torque - L + w / 2, w);
    }
    if (a.limits_speed() && torque * motor_qd / N > 0) {
      const double w = a.speed_limit_width,
                   u = std::clamp((std::abs(motor_qd / N) - a.speed_limit + w) / w, 0.0, 1.0);
      torque *= 1 - 10 * std::pow(u, 3) + 15 * std::pow(u, 4) - 6 * std::pow(u, 5);
    }
    if (!a.is_elastic()) continue;
    const double twist = scene.y[place.motor_q] / N - q, rate = motor_qd / N - qd;
    double gear = a.stiffness * twist + a.damping * rate;
    if (a.backlash > 0) {
      const double depth = std::abs(twist) - a.backlash / 2,
                   u = std::clamp(depth / a.backlash_width, 0.0, 1.0);
      gear = std::copysign(a.stiffness * onset(depth, a.backlash_width), twist) +
             a.damping * (3 * u * u - 2 * u * u * u) * rate;
    }
    EXPECT_EQ(scene.ydot[place.motor_q], motor_qd);
    EXPECT_NEAR(scene.ydot[place.motor_qd], (torque - gear) / N / a.rotor_inertia,
                1e-11 * (1 + std::abs(torque) + std::abs(gear)) / a.rotor_inertia);
    torque = gear;
  }
  Vector qdd(scene.plan.nv), drive(scene.plan.nv);
  scene.system.accelerations(0, scene.y.data(), qdd.data());
  const auto at = scene.system.coordinates(0, scene.y.data());
  scene.system.drive_forces(at, qdd.data(), drive.data());
  for (int i = 0; i < scene.plan.nv; ++i)
    EXPECT_NEAR(drive[i], scene.plan.joints[i].prescribed ? drive[i] : tau[i],
                1e-11 * (1 + std::abs(tau[i])));
}

TEST_P(Actuated, the_jacobian_knows_actuators_and_the_law_that_acts_through_them) {
  for (Law law : {Law::none, Law::pd, Law::gravity_compensation, Law::computed_torque}) {
    Scene scene(random, tree(law));
    System& system = scene.system;
    const int size = system.size();
    // gains are exact, a model's part is differences of first order
    const double tolerance = law == Law::gravity_compensation || law == Law::computed_torque ? 1e-4 : 3e-6;
    DenseJacobian jacobian(system);
    std::vector<double> matrix(static_cast<std::size_t>(size * size)), up(scene.y), down(scene.y), y(scene.y);
    ASSERT_EQ(jacobian.evaluate(0, y.data(), matrix.data()), Status::ok);
    for (int j = 0; j < size; ++j) {
      constexpr double h = 1e-6;
      y[j] = scene.y[j] + h;
      system.right_hand_side(0, y.data(), up.data());
      y[j] = scene.y[j] - h;
      system.right_hand_side(0, y.data(), down.data());
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

TEST_P(Actuated, power_is_the_rate_of_energy) {
  // prescribed joints would move within the difference
  Scene scene(random, tree(Law::none, 0));
  const auto energy = [&](double h) {
    std::vector<double> y(scene.y);
    for (std::size_t i = 0; i < y.size(); ++i) y[i] += h * scene.ydot[i];
    return scene.system.kinetic_energy(0, y.data()) + scene.system.potential_energy(0, y.data());
  };
  constexpr double h = 1e-5;
  const double rate = (8 * (energy(h) - energy(-h)) - (energy(2 * h) - energy(-2 * h))) / (12 * h);
  EXPECT_NEAR(scene.ydot.back(), rate, 1e-6 * (1 + std::abs(rate) + std::abs(energy(0))));
}

TEST_P(Actuated, states_of_rest_keep_actuators_at_rest) {
  Scene scene(random, tree(Law::none));
  if (!scene.system.actuators()) return;
  Actuators& actuators = *scene.system.actuators();
  const StateLayout& layout = scene.system.layout();
  for (int k = 0; k < layout.qd.count; ++k) scene.y[layout.qd[k]] = 0;
  Vector qdd(scene.plan.nv), moving(scene.plan.nv);
  actuators.rest(true);
  scene.system.accelerations(0, scene.y.data(), qdd.data());
  actuators.rest(false);
  actuators.set_rest(scene.y.data());
  scene.system.right_hand_side(0, scene.y.data(), scene.ydot.data());
  for (int i = layout.motor_q.begin; i < layout.work.begin; ++i) EXPECT_NEAR(scene.ydot[i], 0, 1e-9);
  scene.system.accelerations(0, scene.y.data(), moving.data());
  EXPECT_LT(relative_difference(qdd, moving), 1e-9);
}

}  // namespace
}  // namespace redysim
