#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "model/model.hpp"

// Models of any size for tests and benchmarks.

namespace redysim::test {

// A slender rod of `length` along x: the link of a chain or a bar.
inline Link rod(const std::string& name, int parent, double length, double mass) {
  Link link;
  link.name = name;
  link.parent = parent;
  link.joint.name = name + "_joint";
  link.mass = mass;
  link.com = {0.5 * length, 0, 0};
  const double across = mass * length * length / 12, along = 0.01 * across;
  link.inertia = {along, across + along, across + along, 0, 0, 0};
  return link;
}

// A serial chain of n revolute joints with full inertias; twists of right angles only, or any.
inline Model serial_chain(int n, bool right_angles) {
  constexpr double quarter = 1.5707963267948966;
  Model model;
  model.name = "chain";
  for (int i = 0; i < n; ++i) {
    Link link = rod("link" + std::to_string(i), i - 1, 0.2, 1);
    link.com += Vec3<double>(0, 0.01, -0.02);
    link.inertia = {0.011, 0.013, 0.012, 0.001, -0.0005, 0.0007};
    link.joint.dh.a = i == 0 ? 0 : 0.2;
    link.joint.dh.d = i % 2 == 0 ? 0.05 : 0;
    link.joint.dh.alpha = right_angles ? (i % 3 == 0   ? 0
                                          : i % 3 == 1 ? quarter
                                                       : -quarter)
                                       : 0.3 + 0.37 * (i % 5);
    model.links.push_back(link);
  }
  return model;
}

// n parallelogram four-bars, each standing on the coupler of the one before (crank, rocker and coupler of
// 0.2 m, base of 0.3 m), the first on the ground. Closed at q = (angle, angle, -angle) in each.
inline Model four_bar_chain(int n, LoopType type = LoopType::revolute) {
  Model model;
  model.name = "four_bar_chain";
  model.gravity = {0, -9.81, 0};
  for (int k = 0; k < n; ++k) {
    const int base = k == 0 ? ground : 3 * k - 1;
    const std::string tag = std::to_string(k);
    Link crank = rod("crank" + tag, base, 0.2, 0.5), rocker = rod("rocker" + tag, base, 0.2, 0.6);
    rocker.joint.dh.a = 0.3;
    Link coupler = rod("coupler" + tag, 3 * k, 0.3, 0.8);
    coupler.joint.dh.a = 0.2;
    model.links.push_back(crank);
    model.links.push_back(rocker);
    model.links.push_back(coupler);
    Loop loop;
    loop.name = "loop" + tag;
    loop.type = type;
    loop.link_a = 3 * k + 1;
    loop.point_a = {0.2, 0, 0};
    loop.link_b = 3 * k + 2;
    loop.point_b = {0.3, 0, 0};
    loop.directions = {Vec3<double>::UnitX(), Vec3<double>::UnitY()};
    model.loops.push_back(loop);
  }
  return model;
}

// q of four_bar_chain with crank k at angle[k] to its base.
template <class Angle>
std::vector<double> four_bar_chain_pose(int n, Angle angle) {
  std::vector<double> q;
  for (int k = 0; k < n; ++k) {
    q.push_back(angle(k));
    q.push_back(angle(k));
    q.push_back(-angle(k));
  }
  return q;
}

// A zigzag of n + 2 rods of 0.2 m in which a bar pins each link to the next but one, so that neighbouring
// loops share joints. Two degrees of freedom for any n.
inline Model overlapping_loops(int n) {
  Model model;
  model.name = "overlapping_loops";
  model.gravity = {0, -9.81, 0};
  for (int i = 0; i < n + 2; ++i) {
    Link link = rod("link" + std::to_string(i), i - 1, 0.2, 0.5);
    if (i > 0) link.joint.dh.a = 0.2;
    model.links.push_back(link);
  }
  const double length = std::hypot(0.25 + 0.2 * std::cos(0.6), 0.2 * std::sin(0.6));
  for (int i = 0; i < n; ++i) {
    Link bar = rod("bar" + std::to_string(i), i, length, 0.3);
    bar.joint.dh.a = 0.05;
    model.links.push_back(bar);
    Loop loop;
    loop.name = "loop" + std::to_string(i);
    loop.type = LoopType::revolute;
    loop.link_a = n + 2 + i;
    loop.point_a = {length, 0, 0};
    loop.link_b = i + 2;
    loop.point_b = {0.1, 0, 0};
    model.loops.push_back(loop);
  }
  return model;
}

inline std::vector<double> overlapping_loops_pose(int n) {
  std::vector<double> q;
  for (int i = 0; i < n + 2; ++i) q.push_back(i == 0 ? 0.3 : i % 2 == 1 ? 0.6 : -0.6);
  for (int i = 0; i < n; ++i) {
    const double turn = q[static_cast<std::size_t>(i) + 1];
    q.push_back(std::atan2(0.2 * std::sin(turn), 0.25 + 0.2 * std::cos(turn)));
  }
  return q;
}

}  // namespace redysim::test
