#include <gtest/gtest.h>

#include "support/evaluate.hpp"
#include "support/mechanisms.hpp"

// Closed forms written by hand. Gravity g along -y, q from the x axis, rods of length l and mass m with
// moment of inertia I about the com at distance c.

namespace redysim {
namespace {

using test::Evaluate;
using test::Vector;

constexpr double g = 9.81;

Model planar(std::vector<Link> links) {
  Model model;
  model.gravity = {0, -g, 0};
  model.links = std::move(links);
  return model;
}

// (I + m c^2 + armature) qdd = tau - m g c cos q - k (q - rest) - damping qd
TEST(Pendulum, acceleration_has_its_closed_form) {
  Link link = test::rod("rod", ground, 0.8, 1.3);
  link.joint.stiffness = 2;
  link.joint.rest = 0.3;
  link.joint.damping = 0.4;
  link.joint.armature = 0.05;
  Evaluate<double> pendulum(planar({link}));
  const double c = 0.4, inertia = link.inertia[2] + 1.3 * c * c + 0.05;
  for (double q = -3; q < 3; q += 0.37) {
    const double qd = 2 - q, tau = 0.7;
    const double expected = (tau - 1.3 * g * c * std::cos(q) - 2 * (q - 0.3) - 0.4 * qd) / inertia;
    EXPECT_NEAR(pendulum.qdd(Vector{{q}}, Vector{{qd}}, Vector{{tau}})[0], expected,
                1e-13 * std::abs(expected) + 1e-14);
  }
}

// Spong, Hutchinson, Vidyasagar 2006, (7.87)-(7.91), relative joint angles.
TEST(DoublePendulum, inertia_and_bias_have_their_closed_form) {
  const double l = 0.7, m1 = 1.2, m2 = 0.8, c1 = 0.35, c2 = 0.25;
  Link first = test::rod("first", ground, l, m1), second = test::rod("second", 0, 0.5, m2);
  second.joint.dh.a = l;
  Evaluate<double> arm(planar({first, second}));
  const double I1 = first.inertia[2], I2 = second.inertia[2];
  for (double q2 = -3; q2 < 3; q2 += 0.29) {
    const double q1 = 1.1 - q2 * q2, qd1 = 0.6 + q2, qd2 = -1.4, qdd1 = 2, qdd2 = -q2;
    const double d11 = m1 * c1 * c1 + m2 * (l * l + c2 * c2 + 2 * l * c2 * std::cos(q2)) + I1 + I2;
    const double d12 = m2 * (c2 * c2 + l * c2 * std::cos(q2)) + I2, d22 = m2 * c2 * c2 + I2;
    const double h = -m2 * l * c2 * std::sin(q2);
    const double phi2 = m2 * c2 * g * std::cos(q1 + q2), phi1 = (m1 * c1 + m2 * l) * g * std::cos(q1) + phi2;
    const double tau1 = d11 * qdd1 + d12 * qdd2 + h * (2 * qd1 * qd2 + qd2 * qd2) + phi1;
    const double tau2 = d12 * qdd1 + d22 * qdd2 - h * qd1 * qd1 + phi2;
    const Vector tau = arm.tau(Vector{{q1, q2}}, Vector{{qd1, qd2}}, Vector{{qdd1, qdd2}});
    EXPECT_NEAR(tau[0], tau1, 1e-13 * (1 + std::abs(tau1)));
    EXPECT_NEAR(tau[1], tau2, 1e-13 * (1 + std::abs(tau2)));
    const Vector qdd = arm.qdd(Vector{{q1, q2}}, Vector{{qd1, qd2}}, Vector{{tau1, tau2}});
    EXPECT_NEAR(qdd[0], qdd1, 1e-12 * (1 + std::abs(qdd1)));
    EXPECT_NEAR(qdd[1], qdd2, 1e-12 * (1 + std::abs(qdd2)));
  }
}

// A bead on a turning rod: (I + m r^2) theta'' = tau - 2 m r r' theta' - m g r cos, m r'' = f + m r theta'^2
// - m g sin
TEST(BeadOnARod, coriolis_and_centrifugal_force_have_their_closed_form) {
  Link rod, bead;
  rod.inertia = {0, 0, 0.2, 0, 0, 0};
  bead.parent = 0;
  bead.mass = 0.5;
  bead.joint.type = JointType::prismatic;
  constexpr double quarter = 1.5707963267948966;
  bead.joint.dh = {quarter, 0, quarter, 0, 0, 0};  // z of the bead along x of the rod
  Evaluate<double> system(planar({rod, bead}));
  const double q = 0.4, r = 0.9, qd = 1.7, rd = -0.6, tau = 0.3, f = 2;
  const Vector qdd = system.qdd(Vector{{q, r}}, Vector{{qd, rd}}, Vector{{tau, f}});
  EXPECT_NEAR(qdd[0], (tau - 2 * 0.5 * r * rd * qd - 0.5 * g * r * std::cos(q)) / (0.2 + 0.5 * r * r), 1e-13);
  EXPECT_NEAR(qdd[1], f / 0.5 + r * qd * qd - g * std::sin(q), 1e-13);
}

// A body on a screw along z, its center of mass at distance r from the axis:
//   (I + m r^2 + m p^2 + armature) q'' = tau - damping q' + m (r e_turn + p e_z) . gravity
TEST(Screw, acceleration_has_its_closed_form) {
  Link nut;
  nut.joint.type = JointType::screw;
  nut.joint.pitch = -0.3;
  nut.joint.damping = 0.4;
  nut.joint.armature = 0.05;
  nut.mass = 1.7;
  const double r = 0.6, p = -0.3, m = 1.7;
  nut.com = {r, 0, 0.2};
  nut.inertia = {0.1, 0.2, 0.25, 0.01, 0.02, 0.03};
  Model model = planar({nut});
  model.gravity = {2, -3, -g};
  Evaluate<double> screw(model);
  const double inertia = 0.25 + m * (r * r + p * p) + 0.05;
  for (double q = -7; q < 7; q += 0.83) {
    const double qd = 2 - q, tau = 0.7;
    const double weight = m * (r * (-2 * std::sin(q) - 3 * std::cos(q)) - p * g);
    const double expected = (tau - 0.4 * qd + weight) / inertia;
    EXPECT_NEAR(screw.qdd(Vector{{q}}, Vector{{qd}}, Vector{{tau}})[0], expected,
                1e-13 * std::abs(expected) + 1e-13);
    EXPECT_NEAR(screw.tau(Vector{{q}}, Vector{{qd}}, Vector{{expected}})[0], tau, 1e-12);
  }
}

// The same vertical, without offset: q'' = (tau - m g p) / (I + m p^2).
TEST(Screw, falls_on_its_thread) {
  Link nut;
  nut.joint.type = JointType::screw;
  nut.joint.pitch = 0.02;
  nut.mass = 3;
  nut.inertia = {0.02, 0.02, 0.01, 0, 0, 0};
  Model model = planar({nut});
  model.gravity = {0, 0, -g};
  const double expected = (0.1 - 3 * g * 0.02) / (0.01 + 3 * 0.02 * 0.02);
  EXPECT_NEAR(Evaluate<double>(model).qdd(Vector{{4.0}}, Vector{{-9.0}}, Vector{{0.1}})[0], expected, 1e-13);
}

// A nut on a thread along a turning rod, r = r0 + p q; Ix about the thread, I across:
//   (I_rod + I + m r^2) theta'' = tau - 2 m r p q' theta' - m g r cos
//   (Ix + m p^2) q'' = f + m r p theta'^2 - m g p sin
TEST(ThreadedRod, coriolis_and_centrifugal_force_have_their_closed_form) {
  Link rod, nut;
  rod.inertia = {0, 0, 0.2, 0, 0, 0};
  nut.parent = 0;
  nut.mass = 0.5;
  nut.inertia = {0.03, 0.03, 0.01, 0, 0, 0};
  nut.joint.type = JointType::screw;
  nut.joint.pitch = 0.15;
  constexpr double quarter = 1.5707963267948966;
  const double r0 = 0.3, p = 0.15, m = 0.5;
  nut.joint.dh = {quarter, 0, quarter, 0, 0, r0};  // z of the nut along x of the rod
  Evaluate<double> system(planar({rod, nut}));
  const double angle = 0.4, q = 2.9, rate = 1.7, qd = -6, tau = 0.3, f = 0.2, r = r0 + p * q;
  const Vector qdd = system.qdd(Vector{{angle, q}}, Vector{{rate, qd}}, Vector{{tau, f}});
  EXPECT_NEAR(qdd[0],
              (tau - 2 * m * r * p * qd * rate - m * g * r * std::cos(angle)) / (0.2 + 0.03 + m * r * r),
              1e-12);
  EXPECT_NEAR(qdd[1], (f + m * r * p * rate * rate - m * g * p * std::sin(angle)) / (0.01 + m * p * p),
              1e-12);
}

// A spindle that turns in a nut, which a guide keeps from turning: x = -p q1 for the carriage,
//   (I_spindle + m p^2) q1'' = tau + m g p
TEST(LeadScrew, spindle_acceleration_has_its_closed_form) {
  Link spindle, carriage;
  spindle.inertia = {0, 0, 0.004, 0, 0, 0};
  carriage.parent = 0;
  carriage.mass = 12;
  carriage.inertia = {0.1, 0.2, 0.3, 0, 0, 0};
  carriage.joint.type = JointType::screw;
  carriage.joint.pitch = 0.0008;
  Model model = planar({spindle, carriage});
  model.gravity = {0, 0, -g};
  Loop guide;
  guide.type = LoopType::prismatic;
  guide.link_b = 1;
  guide.point_a = guide.point_b = {0.2, 0.1, 0};
  model.loops = {guide};
  const double p = 0.0008, m = 12, tau = 0.5, expected = (tau + m * g * p) / (0.004 + m * p * p);
  const Vector qdd =
      Evaluate<double>(model).qdd(Vector{{11.0, -11.0}}, Vector{{30.0, -30.0}}, Vector{{tau, 0.0}});
  EXPECT_NEAR(qdd[0], expected, 1e-9 * expected);
  EXPECT_NEAR(qdd[1], -expected, 1e-9 * expected);
}

// Flywheel spinning about its own axis on a turntable: moment about the third axis is I qd1 qd2.
TEST(Gyroscope, reaction_moment_has_its_closed_form) {
  constexpr double quarter = 1.5707963267948966;
  Link table, gimbal, wheel;
  table.inertia = gimbal.inertia = {0.1, 0.1, 0.1, 0, 0, 0};
  gimbal.parent = 0;
  gimbal.joint.dh.alpha = quarter;
  wheel.parent = 1;
  wheel.mass = 1;
  wheel.inertia = {0.3, 0.3, 0.5, 0, 0, 0};
  wheel.joint.dh.alpha = quarter;
  Model model = planar({table, gimbal, wheel});
  model.gravity.setZero();
  Evaluate<double> gyro(model);
  // precession about z (joint 1), spin about the wheel's axis (joint 3), gimbal held perpendicular to both
  const double precession = 0.8, spin = 25;
  const Vector tau = gyro.tau(Vector{{0.3, quarter, 0.7}}, Vector{{precession, 0, spin}}, Vector::Zero(3));
  EXPECT_NEAR(std::abs(tau[1]), 0.5 * precession * spin, 1e-12);
  EXPECT_NEAR(tau[0], 0, 1e-12);
  EXPECT_NEAR(tau[2], 0, 1e-12);
}

// A mechanism of one degree of freedom in a coordinate s: with T = 1/2 m(s) s'^2 and V(s),
//   m s'' = tau - 1/2 m'(s) s'^2 - V'(s)
struct Reduced {
  Dual mass = 0, potential = 0;
  // a bar with given mass, moment of inertia, com and the derivatives of com and angle by s
  void add(double m, double I, const Dual& x_slope, const Dual& y_slope, const Dual& turn, const Dual& y) {
    mass += m * (x_slope * x_slope + y_slope * y_slope) + I * turn * turn;
    potential += m * g * y;
  }
  double acceleration(double rate, double tau) const {
    return (tau - 0.5 * mass.derivative * rate * rate - potential.derivative) / mass.value;
  }
};

// Crank r and rod l with the slider on the x axis: r sin q = l sin p for the rod's angle -p.
TEST(SliderCrank, crank_acceleration_has_its_closed_form) {
  const double r = 0.3, l = 0.8, m1 = 1, m2 = 1.5, m3 = 2;
  constexpr double quarter = 1.5707963267948966;
  Link crank = test::rod("crank", ground, r, m1), rod = test::rod("rod", 0, l, m2), slider;
  rod.joint.dh.a = r;
  slider.joint.type = JointType::prismatic;
  slider.joint.dh = {quarter, 0, quarter, 0, 0, 0};  // along x of the ground
  slider.mass = m3;
  Model model = planar({crank, rod, slider});
  Loop pin;
  pin.type = LoopType::point;
  pin.link_a = 1;
  pin.point_a = {l, 0, 0};
  pin.link_b = 2;
  pin.directions = {Vec3<double>::UnitX(), Vec3<double>::UnitY()};
  model.loops = {pin};
  Evaluate<double> mechanism(model);
  for (double angle = 0.1; angle < 6.2; angle += 0.31) {
    const double rate = 3 - angle, tau = 1.5;
    const Dual q(angle, 1), sine = sin(q), cosine = cos(q);
    const Dual sine_p = r / l * sine, cosine_p = sqrt(1 - sine_p * sine_p);
    const Dual p_slope = r / l * cosine / cosine_p;  // dp/dq
    Reduced reduced;
    reduced.add(m1, crank.inertia[2], -0.5 * r * sine, 0.5 * r * cosine, 1, 0.5 * r * sine);
    reduced.add(m2, rod.inertia[2], -r * sine - 0.5 * l * sine_p * p_slope, 0.5 * r * cosine, p_slope,
                0.5 * r * sine);
    const Dual slide = -r * sine - l * sine_p * p_slope;
    reduced.add(m3, 0, slide, 0, 0, 0);
    const double p = std::asin(sine_p.value);
    const Vector x{{angle, -p - angle, r * cosine.value + l * cosine_p.value}};
    const Vector v = rate * Vector{{1, -p_slope.value - 1, slide.value}};
    const double expected = reduced.acceleration(rate, tau);
    EXPECT_NEAR(mechanism.qdd(x, v, Vector{{tau, 0, 0}})[0], expected, 1e-12 * (1 + std::abs(expected)))
        << angle;
  }
}

// Four-bar: the tip of the rocker is where the circles about the crank's tip and the rocker's pivot meet.
TEST(FourBar, crank_acceleration_has_its_closed_form) {
  const double base = 0.5, r = 0.2, l = 0.45, s = 0.4, m1 = 0.5, m2 = 0.9, m3 = 0.7;
  Link crank = test::rod("crank", ground, r, m1), coupler = test::rod("coupler", 0, l, m2);
  Link rocker = test::rod("rocker", ground, s, m3);
  coupler.joint.dh.a = r;
  rocker.joint.dh.a = base;
  Model model = planar({crank, coupler, rocker});
  Loop pin;
  pin.type = LoopType::revolute;
  pin.link_a = 1;
  pin.point_a = {l, 0, 0};
  pin.link_b = 2;
  pin.point_b = {s, 0, 0};
  model.loops = {pin};
  Evaluate<double> mechanism(model);
  for (double angle = 0; angle < 6.2; angle += 0.27) {
    const double rate = 2 - angle, tau = 0.4;
    const Dual q(angle, 1), ax = r * cos(q), ay = r * sin(q);
    // from the crank's tip along the diagonal, then across it
    const Dual dx = base - ax, dy = -ay, square = dx * dx + dy * dy;
    const Dual along = (square + l * l - s * s) / (2 * square), across = sqrt(l * l / square - along * along);
    const Dual ux = along * dx - across * dy, uy = along * dy + across * dx;  // coupler, as a vector
    const Dual wx = ux - dx, wy = uy - dy;                                    // rocker
    // velocities per unit crank rate: a' + t2 k x u = t3 k x w, solved by dot products with w and u
    const Dual ax_slope = -ay, ay_slope = ax;
    const Dual t2 = -(ax_slope * wx + ay_slope * wy) / (ux * wy - uy * wx);
    const Dual t3 = -(ax_slope * ux + ay_slope * uy) / (ux * wy - uy * wx);
    Reduced reduced;
    reduced.add(m1, crank.inertia[2], 0.5 * ax_slope, 0.5 * ay_slope, 1, 0.5 * ay);
    reduced.add(m2, coupler.inertia[2], ax_slope - 0.5 * t2 * uy, ay_slope + 0.5 * t2 * ux, t2,
                ay + 0.5 * uy);
    reduced.add(m3, rocker.inertia[2], -0.5 * t3 * wy, 0.5 * t3 * wx, t3, 0.5 * wy);
    const Vector x{{angle, std::atan2(uy.value, ux.value) - angle, std::atan2(wy.value, wx.value)}};
    const Vector v = rate * Vector{{1, t2.value - 1, t3.value}};
    const double expected = reduced.acceleration(rate, tau);
    EXPECT_NEAR(mechanism.qdd(x, v, Vector{{tau, 0, 0}})[0], expected, 1e-11 * (1 + std::abs(expected)))
        << angle;
    EXPECT_LT(mechanism.rate(x, v).lpNorm<Eigen::Infinity>(), 1e-13);
  }
}

// A parallelogram turns like one pendulum: the coupler does not rotate, so with I about the pivots
//   (I_crank + I_rocker + m_coupler r^2) qdd = -g cos q (m_crank c + m_rocker c + m_coupler r)
// for any masses, next to none included: then one bar alone moves the others.
TEST(Parallelogram, acceleration_has_its_closed_form_for_any_masses) {
  constexpr double r = 0.2, c = 0.1;
  for (int light = 0; light < 8; ++light)
    for (double factor : {1.0, 1e-3, 1e-6, 1e-9, 1e-12}) {
      if (light == 7 && factor < 1) continue;
      Model model = test::four_bar_chain(1);
      double inertia = 0, weight = 0;
      for (int k = 0; k < 3; ++k) {
        Link& link = model.links[k];
        if (light >> k & 1) {
          link.mass *= factor;
          for (double& entry : link.inertia) entry *= factor;
        }
        inertia += link.mass * (k == 2 ? r * r : c * c) + (k == 2 ? 0 : link.inertia[2]);
        weight += link.mass * g * (k == 2 ? r : c);
      }
      Evaluate<double> bars(model);
      for (double q = 0.13; q < 3; q += 0.31) {
        const double qd = 1.7, qdd = -weight / inertia * std::cos(q);
        const Vector found = bars.qdd(Vector{{q, q, -q}}, Vector{{qd, qd, -qd}}, Vector::Zero(3));
        EXPECT_LT((found - Vector{{qdd, qdd, -qdd}}).lpNorm<Eigen::Infinity>(), 1e-9)
            << "links " << light << " x " << factor << " at " << q;
      }
    }
}

}  // namespace
}  // namespace redysim
