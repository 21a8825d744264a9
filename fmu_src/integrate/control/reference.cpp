#include "integrate/control/reference.hpp"

#include <algorithm>
#include <cmath>

namespace redysim {
namespace {

constexpr double two_pi = 6.28318530717958647692;

// ReDySim's cycloid: velocity and acceleration are 0 at both ends.
JointMotion cycloid(const Trajectory& trajectory, double time) {
  const double length = trajectory.end - trajectory.begin, rate = (trajectory.to - trajectory.from) / length;
  const double since = time - trajectory.begin, angle = two_pi * since / length;
  const double sine = std::sin(angle);
  return {trajectory.from + rate * (since - length / two_pi * sine), rate * (1 - std::cos(angle)),
          rate * two_pi / length * sine};
}

// Horner's scheme for a polynomial and its two derivatives.
JointMotion polynomial(const Trajectory::Piece& piece, double time) {
  const double t = time - piece.knot;
  JointMotion motion;
  double half_qdd = 0;
  for (std::size_t k = piece.coefficients.size(); k-- > 0;) {
    half_qdd = half_qdd * t + motion.qd;
    motion.qd = motion.qd * t + motion.q;
    motion.q = motion.q * t + piece.coefficients[k];
  }
  motion.qdd = 2 * half_qdd;
  return motion;
}

// The piece after the one that holds a time.
std::vector<Trajectory::Piece>::const_iterator next_piece(const Trajectory& trajectory, double time) {
  return std::upper_bound(trajectory.pieces.begin() + 1, trajectory.pieces.end(), time,
                          [](double t, const Trajectory::Piece& piece) { return t < piece.knot; });
}

// The function inside the interval, continued beyond its ends.
JointMotion inside(const Trajectory& trajectory, double time) {
  if (trajectory.kind == Trajectory::Kind::cycloid) return cycloid(trajectory, time);
  return polynomial(*(next_piece(trajectory, time) - 1), time);
}

}  // namespace

Phase phase_at(const Trajectory& trajectory, double time) {
  return time < trajectory.begin ? Phase::before : time < trajectory.end ? Phase::inside : Phase::after;
}

double end_of(const Trajectory& trajectory, Phase phase) {
  return phase == Phase::before   ? trajectory.begin
         : phase == Phase::inside ? trajectory.end
                                  : std::numeric_limits<double>::infinity();
}

double next_knot(const Trajectory& trajectory, double time) {
  if (trajectory.pieces.empty()) return std::numeric_limits<double>::infinity();
  const auto next = next_piece(trajectory, time);
  return next == trajectory.pieces.end() ? std::numeric_limits<double>::infinity() : next->knot;
}

JointMotion motion_at(const Trajectory& trajectory, Phase phase, double time) {
  if (phase == Phase::inside) return inside(trajectory, time);
  const double end_point = phase == Phase::before ? trajectory.begin : trajectory.end;
  JointMotion motion = inside(trajectory, end_point);
  motion.q += motion.qd * (time - end_point);
  motion.qdd = 0;
  return motion;
}

double jerk_at(const Trajectory& trajectory, Phase phase, double time) {
  if (phase != Phase::inside) return 0;
  if (trajectory.kind == Trajectory::Kind::cycloid) {
    const double length = trajectory.end - trajectory.begin, frequency = two_pi / length;
    return (trajectory.to - trajectory.from) / length * frequency * frequency *
           std::cos(frequency * (time - trajectory.begin));
  }
  const Trajectory::Piece& piece = *(next_piece(trajectory, time) - 1);
  double jerk = 0;
  for (std::size_t k = piece.coefficients.size(); k-- > 3;)
    jerk = jerk * (time - piece.knot) + static_cast<double>(k * (k - 1) * (k - 2)) * piece.coefficients[k];
  return jerk;
}

}  // namespace redysim
