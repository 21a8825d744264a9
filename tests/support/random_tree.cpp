#include "support/random_tree.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <string>

namespace redysim::test {
namespace {

double random_alpha(Random& random, bool right_angles) {
  constexpr double quarter = 1.5707963267948966;
  const double choice[] = {0, quarter, -quarter, 2 * quarter};
  return right_angles || random.chance(0.4) ? choice[random.index(4)] : random.between(-3, 3);
}

void give_joint(Random& random, const TreeOptions& options, Joint& joint, int i) {
  joint.name = "joint" + std::to_string(i);
  if (options.prismatic && random.chance(0.25)) joint.type = JointType::prismatic;
  if (options.fixed && i > 0 && random.chance(0.2)) joint.type = JointType::fixed;
  joint.dh.alpha = random_alpha(random, options.right_angles);
  joint.dh.a = random.chance(0.2) ? 0 : random.between(-0.6, 0.6);
  joint.dh.theta = random.between(-3, 3);
  joint.dh.d = random.chance(0.3) ? 0 : random.between(-0.6, 0.6);
  if (options.branches && random.chance(0.4)) {
    joint.dh.gamma = random.between(-3, 3);
    joint.dh.b = random.between(-0.5, 0.5);
  }
  if (!options.passive) return;
  if (random.chance(0.4)) joint.armature = random.between(0.01, 0.3);
  if (random.chance(0.4)) joint.damping = random.between(0.01, 1);
  if (random.chance(0.4)) {
    joint.stiffness = random.between(0.1, 5);
    joint.rest = random.between(-1, 1);
  }
}

// Crosses: two skew axes of which the first has no inertia of its own, carried on by a body with inertia.
void take_masses(Random& random, std::vector<Link>& links) {
  for (std::size_t i = 0; i + 1 < links.size(); ++i) {
    Link& link = links[i];
    const Link& next = links[i + 1];
    const bool cross = link.joint.type == JointType::revolute && next.joint.type == JointType::revolute &&
                       next.parent == static_cast<int>(i) && next.mass > 0 &&
                       std::abs(std::sin(next.joint.dh.alpha)) > 0.3;
    if (!cross || (i > 0 && links[i - 1].mass == 0) || !random.chance(0.5)) continue;
    link.mass = 0;
    link.com.setZero();
    link.inertia = {};
  }
}

}  // namespace

double Random::between(double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(engine_);
}

int Random::index(int count) { return std::uniform_int_distribution<int>(0, count - 1)(engine_); }

bool Random::chance(double probability) { return between(0, 1) < probability; }

Vec3<double> Random::vector(double size) {
  return {between(-size, size), between(-size, size), between(-size, size)};
}

Vec3<double> Random::direction() {
  Vec3<double> v = vector(1);
  while (v.norm() < 0.2) v = vector(1);
  return v.normalized();
}

std::vector<double> Random::numbers(int count, double size) {
  std::vector<double> v(static_cast<std::size_t>(count));
  for (double& value : v) value = between(-size, size);
  return v;
}

void give_inertia(Random& random, Link& link) {
  link.mass = random.between(0.2, 2);
  link.com = random.vector(0.3);
  const double x = random.between(0.01, 0.1), y = random.between(0.01, 0.1), z = random.between(0.01, 0.1);
  const Mat3<double> axes = Eigen::Quaterniond(random.between(0.1, 1), random.between(-1, 1),
                                               random.between(-1, 1), random.between(-1, 1))
                                .normalized()
                                .toRotationMatrix();
  const Mat3<double> I = axes * Vec3<double>(y + z, z + x, x + y).asDiagonal() * axes.transpose();
  link.inertia = {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)};
}

void give_resistance(Random& random, Joint& joint) {
  if (random.chance(0.5)) {
    joint.friction = random.between(0.1, 2);
    if (random.chance(0.5)) joint.static_friction = random.between(2, 3);
    joint.friction_velocity = random.between(0.3, 2);
  }
  if (random.chance(0.3)) return;
  if (random.chance(0.7)) joint.lower = random.between(-1, -0.1);
  if (random.chance(0.7)) joint.upper = random.between(0.1, 1);
  joint.stop_stiffness = random.between(0.1, 20);
  joint.stop_damping = random.between(0, 1);
  joint.stop_width = random.between(0.1, 1);
}

SpringDamper random_spring(Random& random, int links) {
  SpringDamper spring;
  spring.link_a = random.index(links + 1) - 1;
  spring.link_b = random.index(links + 1) - 1;
  spring.point_a = random.vector(0.5);
  spring.point_b = random.vector(0.5) + Vec3<double>(0, 0, 1);
  spring.stiffness = random.between(1, 20);
  spring.damping = random.between(0, 2);
  spring.rest_length = random.between(0, 1);
  return spring;
}

Bushing random_bushing(Random& random, int links) {
  const auto rotation = [&random] {
    return Mat3<double>(Eigen::AngleAxisd(random.between(-3, 3), random.vector(1).normalized()));
  };
  const auto positive = [&random](double largest) {
    return Vec3<double>(random.between(0, largest), random.between(0, largest), random.between(0, largest));
  };
  Bushing bushing;
  bushing.link_a = random.index(links + 1) - 1;
  bushing.link_b = random.index(links + 1) - 1;
  bushing.point_a = random.vector(0.5);
  bushing.point_b = random.vector(0.5);
  bushing.rotation_a = rotation();
  bushing.rotation_b = rotation();
  bushing.stiffness = positive(20);
  bushing.turning_stiffness = positive(10);
  bushing.damping = positive(2);
  bushing.turning_damping = positive(1);
  return bushing;
}

Model random_tree(Random& random, const TreeOptions& options) {
  Model model;
  model.name = "random";
  model.gravity = random.vector(10);
  for (int i = 0; i < options.links; ++i) {
    Link link;
    link.name = "link" + std::to_string(i);
    link.parent = i == 0 ? ground : i - 1;
    if (options.branches && random.chance(0.4)) link.parent = random.index(i + 1) - 1;
    give_joint(random, options, link.joint, i);
    give_inertia(random, link);
    model.links.push_back(link);
  }
  // each from a source of its own, so that models without them stay as they were
  Random threads = random, resistance = random;
  if (options.screws)
    for (Link& link : model.links) {
      if (link.joint.type != JointType::revolute || !threads.chance(0.25)) continue;
      link.joint.type = JointType::screw;
      link.joint.pitch = threads.between(0.05, 0.5) * (threads.chance(0.5) ? 1 : -1);
    }
  if (options.resistance)
    for (Link& link : model.links) give_resistance(resistance, link.joint);
  if (options.massless) take_masses(random, model.links);
  for (int k = 0; options.springs && k < 2; ++k) {
    model.springs.push_back(random_spring(random, options.links));
    model.springs.back().name = "spring" + std::to_string(k);
  }
  return model;
}

TreeOptions options_of(unsigned seed) {
  TreeOptions options;
  options.links = 2 + static_cast<int>(seed * 7 % 15);
  options.right_angles = seed % 3 == 0;
  options.branches = seed % 4 != 1;
  options.prismatic = seed % 5 != 2;
  options.screws = seed % 3 != 2;
  options.passive = seed % 2 == 0;
  options.resistance = seed % 8 >= 5;
  options.springs = seed % 7 == 0;
  options.fixed = seed % 6 != 3;
  return options;
}

}  // namespace redysim::test
