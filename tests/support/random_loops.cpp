#include "support/random_loops.hpp"

#include <algorithm>

#include "model/dh.hpp"
#include "support/dense.hpp"

namespace redysim::test {

std::vector<Pose> poses_at(const Model& model, const Vector& q) {
  std::vector<Pose> poses;
  Eigen::Index next = 0;
  for (const Link& link : model.links) {
    DhParameters dh = link.joint.dh;
    switch (link.joint.type) {
      case JointType::revolute:
        dh.theta += q[next++];
        break;
      case JointType::prismatic:
        dh.d += q[next++];
        break;
      case JointType::screw:
        dh.d += link.joint.pitch * q[next];
        dh.theta += q[next++];
        break;
      case JointType::fixed:
        break;
    }
    const Pose own = pose_of(dh);
    poses.push_back(link.parent == ground ? own : poses[link.parent] * own);
  }
  return poses;
}

int moving_joints(const Model& model) {
  return static_cast<int>(std::count_if(model.links.begin(), model.links.end(), [](const Link& link) {
    return link.joint.type != JointType::fixed;
  }));
}

Loop closed_loop(Random& random, LoopType type, int a, int b, const std::vector<Pose>& poses) {
  const Pose at_a = a == ground ? Pose() : poses[a], at_b = b == ground ? Pose() : poses[b];
  Loop loop;
  loop.name = "loop";
  loop.type = type;
  loop.link_a = a;
  loop.link_b = b;
  loop.point_a = random.vector(0.5);
  const Mat3<double> into_b = at_b.rotation.transpose() * at_a.rotation;
  loop.point_b = at_b.rotation.transpose() * (at_a.rotation * loop.point_a + at_a.position - at_b.position);
  loop.axis_a = random.direction();
  loop.x_a = loop.axis_a.cross(random.direction()).normalized();
  loop.axis_b = into_b * (type == LoopType::universal ? loop.x_a : loop.axis_a);
  loop.x_b = into_b * loop.x_a;
  if (type == LoopType::cylindrical || type == LoopType::prismatic)
    loop.point_b += loop.axis_b * random.between(-0.3, 0.3);
  const int directions = 1 + random.index(3);
  if (type == LoopType::point)
    for (int k = 0; k < directions; ++k) {
      Vec3<double> direction = random.direction();
      for (const Vec3<double>& other : loop.directions) direction -= other * other.dot(direction);
      loop.directions.push_back(direction.normalized());
    }
  return loop;
}

Loop repeated_joint(Random& random, const Model& model, int link) {
  Loop loop;
  loop.name = "again";
  loop.link_a = model.links[link].parent;
  loop.link_b = link;
  const JointType joint = model.links[link].joint.type;
  const bool slides = joint == JointType::prismatic, screw = joint == JointType::screw;
  const LoopType turning[] = {LoopType::revolute, LoopType::cylindrical, LoopType::spherical,
                              LoopType::point};
  const LoopType sliding[] = {LoopType::prismatic, LoopType::cylindrical};
  loop.type = screw ? LoopType::cylindrical : slides ? sliding[random.index(2)] : turning[random.index(4)];
  loop.point_b = {0, 0, random.chance(0.3) ? 0 : random.between(-1, 1)};
  if (slides) loop.point_b = random.vector(1);
  loop.directions = {Vec3<double>::UnitX(), Vec3<double>::UnitY(), Vec3<double>::UnitZ()};
  return loop;
}

void match_ends(Loop& loop, const std::vector<Pose>& poses) {
  const Pose at_a = loop.link_a == ground ? Pose() : poses[loop.link_a], at_b = poses[loop.link_b];
  const Mat3<double> into_a = at_a.rotation.transpose() * at_b.rotation;
  loop.point_a = at_a.rotation.transpose() * (at_b.rotation * loop.point_b + at_b.position - at_a.position);
  loop.axis_a = into_a * loop.axis_b;
  loop.x_a = into_a * loop.x_b;
}

Model resized(Model model, double size) {
  const double area = size * size, volume = area * size;
  model.gravity *= size;
  for (Link& link : model.links) {
    link.joint.dh.a *= size;
    link.joint.dh.b *= size;
    link.joint.dh.d *= size;
    link.mass *= volume;
    link.com *= size;
    for (double& entry : link.inertia) entry *= volume * area;
    link.joint.pitch *= size;
    link.joint.armature *= link.joint.type == JointType::prismatic ? volume : volume * area;
  }
  for (Loop& loop : model.loops) {
    loop.point_a *= size;
    loop.point_b *= size;
  }
  return model;
}

Matrix loop_jacobian(const Model& model, const Vector& q) {
  Evaluate<Dual> exact(model);
  const Vector zero = Vector::Zero(q.size());
  Matrix J(static_cast<Eigen::Index>(exact.ws.loop.residual.size()), q.size());
  for (Eigen::Index j = 0; j < q.size(); ++j)
    J.col(j) = derivative(exact.residual(dual(q, Vector::Unit(q.size(), j)), dual(zero, zero)));
  return J;
}

DenseSolution dense_solution(const Model& model, const Vector& q, const Vector& qd, const Vector& tau) {
  Evaluate<double> tree(model);
  Evaluate<Dual> exact(model);
  const Vector zero = Vector::Zero(q.size());
  DenseSolution out;
  out.M = tree.inertia(q);
  out.bias = tree.tau(q, qd, zero);
  out.J = loop_jacobian(model, q);
  // J' qd: how the rates J qd change along qd
  out.quadratic = derivative(exact.rate(dual(q, qd), dual(qd, zero)));
  const Vector free = solve_definite(out.M, tau - out.bias);
  const Matrix response = solve_definite(out.M, out.J.transpose());
  out.S = out.J * response;
  const PseudoInverse inverse = pseudo_inverse(out.S);
  out.rank = inverse.rank;
  out.lambda = inverse.matrix * (-out.quadratic - out.J * free);
  out.qdd = free + response * out.lambda;
  return out;
}

Vector closed_velocity(const Model& model, const Vector& q, const Vector& qd) {
  Evaluate<double> tree(model);
  const Matrix J = loop_jacobian(model, q);
  const Matrix response = solve_definite(tree.inertia(q), J.transpose());
  return qd - response * (pseudo_inverse(J * response).matrix * (J * qd));
}

ClosedCase random_case(Random& random, int links, int loops, const std::vector<LoopType>& types) {
  TreeOptions options;
  options.links = links;
  options.springs = random.chance(0.3);
  options.right_angles = random.chance(0.3);
  options.massless = false;
  ClosedCase c;
  do c.model = random_tree(random, options);
  while (moving_joints(c.model) < links / 2);
  const int n = moving_joints(c.model);
  c.q = vector_of(random.numbers(n, 2));
  const std::vector<Pose> poses = poses_at(c.model, c.q);
  const Plan<double> tree(c.model);
  while (static_cast<int>(c.model.loops.size()) < loops) {
    const int a = random.index(links + 1) - 1, b = random.index(links + 1) - 1;
    const auto joint = [&tree](int link) { return link == ground ? ground : tree.carrier[link]; };
    if (joint(a) == joint(b)) continue;
    const LoopType type = types[random.index(static_cast<int>(types.size()))];
    c.model.loops.push_back(closed_loop(random, type, a, b, poses));
  }
  c.tau = vector_of(random.numbers(n, 5));
  c.qd = closed_velocity(c.model, c.q, vector_of(random.numbers(n, 2)));
  return c;
}

}  // namespace redysim::test
