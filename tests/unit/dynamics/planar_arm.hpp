#pragma once

#include "support/evaluate.hpp"
#include "support/mechanisms.hpp"

// Two rods in the vertical x-y plane, whose equations of motion are known in closed form (Craig 2005,
// section 6.7, with distributed mass).

namespace redysim::test {

struct PlanarArm {
  static constexpr double g = 9.81, l1 = 0.7, l2 = 0.4, m1 = 1.3, m2 = 0.6;
  double i1, i2;  // about the own joint axis, kg m^2
  Model model;

  PlanarArm() {
    model.name = "planar_arm";
    model.gravity = {0, -g, 0};
    model.links = {rod("upper", ground, l1, m1), rod("lower", 0, l2, m2)};
    model.links[1].joint.dh.a = l1;
    i1 = about_joint(model.links[0]);
    i2 = about_joint(model.links[1]);
  }
  static double about_joint(const Link& link) {
    return link.inertia[2] + link.mass * link.com[0] * link.com[0];
  }
  // m2 l1 (l2 / 2): what couples the rods
  static constexpr double coupling = m2 * l1 * l2 / 2;

  Matrix inertia(const Vector& q) const {
    const double c = coupling * std::cos(q[1]);
    Matrix M(2, 2);
    M << i1 + i2 + m2 * l1 * l1 + 2 * c, i2 + c, i2 + c, i2;
    return M;
  }
  Vector coriolis(const Vector& q, const Vector& qd) const {
    const double s = coupling * std::sin(q[1]);
    return vector_of({-s * (2 * qd[0] + qd[1]) * qd[1], s * qd[0] * qd[0]});
  }
  Vector weight(const Vector& q) const {
    const double lower = m2 * g * l2 / 2 * std::cos(q[0] + q[1]);
    return vector_of({(m1 / 2 + m2) * g * l1 * std::cos(q[0]) + lower, lower});
  }
};

inline const Vector arm_q = vector_of({0.4, -1.1}), arm_qd = vector_of({1.7, -2.3});

}  // namespace redysim::test
