#include "integrate/control/reference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "math/angles.hpp"

namespace redysim {
namespace {

constexpr double two_pi = 2 * pi;
// Minimum number of steps: in a piece of a table, and in a trajectory of one piece.
constexpr double steps_of_piece = 3, steps_of_motion = 8;

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

using Pieces = std::vector<Trajectory::Piece>::const_iterator;

int last_phase(const Trajectory& trajectory) { return static_cast<int>(trajectory.jumps.size()) + 2; }

bool is_inside(const Trajectory& trajectory, int phase) {
  return phase > 0 && phase < last_phase(trajectory);
}

// The piece of an inner phase after the piece that contains `time`. Sets `end` to the end of the phase, which
// is returned if there is no such piece.
Pieces next_piece(const Trajectory& trajectory, int phase, double time, Pieces& end) {
  const auto place = static_cast<std::size_t>(phase - 1);
  const auto begin = trajectory.pieces.begin();
  const Pieces first = begin + static_cast<std::ptrdiff_t>(place == 0 ? 0 : trajectory.jumps[place - 1]);
  end = place == trajectory.jumps.size() ? trajectory.pieces.end()
                                         : begin + static_cast<std::ptrdiff_t>(trajectory.jumps[place]);
  // first guess for uniform knots
  const double part = (time - first->knot) / ((end - 1)->knot - first->knot);
  if (part >= 0 && part < 1) {
    const Pieces guess = first + static_cast<std::ptrdiff_t>(part * static_cast<double>(end - 1 - first));
    if (guess->knot <= time && time < (guess + 1)->knot) return guess + 1;
  }
  return std::upper_bound(first + 1, end, time,
                          [](double t, const Trajectory::Piece& piece) { return t < piece.knot; });
}

const Trajectory::Piece& piece_at(const Trajectory& trajectory, int phase, double time) {
  Pieces end;
  return *(next_piece(trajectory, phase, time, end) - 1);
}

// The motion in an inner phase, continued beyond its ends.
JointMotion inside(const Trajectory& trajectory, int phase, double time) {
  if (trajectory.kind == Trajectory::Kind::cycloid) return cycloid(trajectory, time);
  return polynomial(piece_at(trajectory, phase, time), time);
}

}  // namespace

double time_rounding(double time) {
  const double size = std::max(1.0, std::abs(time));
  return std::max(4e-15 * size, std::min(1e-12 * size, 1e-9));
}

int phase_at(const Trajectory& trajectory, double time) {
  int phase = 0;
  while (time >= end_of(trajectory, phase)) ++phase;
  return phase;
}

double end_of(const Trajectory& trajectory, int phase) {
  if (phase == 0) return trajectory.begin;
  if (phase == last_phase(trajectory)) return std::numeric_limits<double>::infinity();
  const auto place = static_cast<std::size_t>(phase - 1);
  return place == trajectory.jumps.size() ? trajectory.end : trajectory.pieces[trajectory.jumps[place]].knot;
}

void limit_step(const Trajectory& trajectory, int phase, double time, StepLimits& limits) {
  limits.knot = std::min(limits.knot, end_of(trajectory, phase));
  if (!is_inside(trajectory, phase)) return;
  const bool table = trajectory.pieces.size() > 1;
  double begin = trajectory.begin, end = trajectory.end;
  bool moves = true;
  if (!trajectory.pieces.empty()) {
    Pieces last;
    const Pieces next = next_piece(trajectory, phase, passed(time), last), piece = next - 1;
    if (next != last) limits.knot = std::min(limits.knot, next->knot);
    if (next != trajectory.pieces.end()) end = next->knot;
    begin = piece->knot;
    // a step in a table uses the acceleration at its start, but may miss a change that is larger than this
    // acceleration
    const std::vector<double>& c = piece->coefficients;
    double change = 0;
    for (std::size_t k = c.size(); k-- > 3;) change = (change + std::fabs(c[k])) * (end - begin);
    const double start = c.size() > 2 ? std::fabs(c[2]) : 0;
    moves = table ? change > start : change + start > 0;
  }
  if (!moves) return;
  limits.longest = std::min(limits.longest, (end - begin) / (table ? steps_of_piece : steps_of_motion));
}

JointMotion motion_at(const Trajectory& trajectory, int phase, double time) {
  if (is_inside(trajectory, phase)) return inside(trajectory, phase, time);
  const double end_point = phase == 0 ? trajectory.begin : trajectory.end;
  JointMotion motion = inside(trajectory, phase == 0 ? 1 : phase - 1, end_point);
  motion.q += motion.qd * (time - end_point);
  motion.qdd = 0;
  return motion;
}

double jerk_at(const Trajectory& trajectory, int phase, double time) {
  if (!is_inside(trajectory, phase)) return 0;
  if (trajectory.kind == Trajectory::Kind::cycloid) {
    const double length = trajectory.end - trajectory.begin, frequency = two_pi / length;
    return (trajectory.to - trajectory.from) / length * frequency * frequency *
           std::cos(frequency * (time - trajectory.begin));
  }
  const Trajectory::Piece& piece = piece_at(trajectory, phase, time);
  double jerk = 0;
  for (std::size_t k = piece.coefficients.size(); k-- > 3;)
    jerk = jerk * (time - piece.knot) + static_cast<double>(k * (k - 1) * (k - 2)) * piece.coefficients[k];
  return jerk;
}

}  // namespace redysim
