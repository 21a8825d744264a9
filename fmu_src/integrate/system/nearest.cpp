#include "integrate/system/nearest.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "dynamics/ball.hpp"

namespace redysim {
namespace {

constexpr int most_moves = 20;
constexpr double exact = 1e-12;      // displacement relative to the scale of its joint
constexpr double negligible = 1e-6;  // tangential part relative to the displacement

// Displacements between the positions of two states, as velocities that cover them in unit time.
class Ways {
 public:
  explicit Ways(const System& system)
      : system_(system), layout_(system.layout()), way_(static_cast<std::size_t>(layout_.nv())) {}

  double* data() { return way_.data(); }

  void set(const double* from, const double* to) {
    for (int k = 0; k < system_.simple(); ++k) simple(k) = to[layout_.q[k]] - from[layout_.q[k]];
    for (int ball = 0; ball < system_.balls(); ++ball) {
      const Eigen::AngleAxisd turn(quaternion(from, ball).conjugate() * quaternion(to, ball));
      turn_of(ball) = turn.angle() * turn.axis();
    }
  }

  double size() {
    double size = 0;
    for (int k = 0; k < system_.simple(); ++k)
      size = std::max(size, std::fabs(simple(k)) / system_.scales()[static_cast<std::size_t>(k)]);
    for (int ball = 0; ball < system_.balls(); ++ball) size = std::max(size, turn_of(ball).norm());
    return size;
  }

  void go(const double* from, double* to) {
    for (int k = 0; k < system_.simple(); ++k) to[layout_.q[k]] = from[layout_.q[k]] + simple(k);
    for (int ball = 0; ball < system_.balls(); ++ball) {
      const Eigen::AngleAxisd turn(turn_of(ball).norm(), turn_of(ball).stableNormalized());
      const Eigen::Quaterniond at = quaternion(from, ball) * Eigen::Quaterniond(turn);
      const double values[] = {at.w(), at.x(), at.y(), at.z()};
      std::copy_n(values, 4, layout_.quaternion.of(to, ball));
    }
  }

 private:
  double& simple(int k) { return way_[static_cast<std::size_t>(layout_.qd[k] - layout_.nq())]; }
  Eigen::Map<Vec3<double>> turn_of(int ball) {
    return Eigen::Map<Vec3<double>>(&way_[static_cast<std::size_t>(layout_.omega[ball] - layout_.nq())]);
  }
  Eigen::Quaterniond quaternion(const double* y, int ball) const {
    const double* q = layout_.quaternion.of(y, ball);
    return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
  }

  const System& system_;
  const StateLayout& layout_;
  std::vector<double> way_;
};

}  // namespace

// Where the loops are open, redundant constraints appear independent, and the corrections of close_loops are
// not minimal. At a closed configuration, the tangential part of the remaining displacement is exact.
bool close_loops_nearest(System& system, double time, double* y) {
  const auto size = static_cast<std::size_t>(system.size());
  const std::vector<double> given(y, y + size);
  if (!system.close_loops(time, y)) return false;
  if (!system.has_constraints()) return true;
  Ways ways(system);
  std::vector<double> next(size), unused(static_cast<std::size_t>(system.plan().nv));
  for (int k = 0; k < most_moves; ++k) {
    ways.set(y, given.data());
    const double whole = ways.size();
    if (whole < exact || system.accelerations(time, y, unused.data()) != Status::ok) break;
    system.project_velocity(ways.data());
    if (ways.size() <= negligible * whole) break;
    next = given;
    ways.go(y, next.data());
    if (!system.close_loops(time, next.data())) break;
    std::copy(next.begin(), next.end(), y);
  }
  return true;
}

}  // namespace redysim
