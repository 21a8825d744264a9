#include "integrate/methods/force_corners.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace redysim {
namespace {

constexpr double never = std::numeric_limits<double>::infinity();

// Until a gap, positive or negative, is zero, s.
double time_to_close(double gap, double rate, double acceleration) {
  const double way = std::fabs(gap), side = gap < 0 ? 1 : -1, speed = side * rate;
  const double towards = speed + std::sqrt(speed * speed + 2 * side * acceleration * way);
  return towards > 0 ? 2 * way / towards : never;
}

bool resists(const System& system, int i) { return system.plan().joints[system.joint_of(i)].has_resistance; }

// To where the force of integrated joint i, which resists, has corners: positions to the begin and end of the
// onset of its stops, then velocities to the begin and end of a reversal against friction. NaN: none.
constexpr std::size_t positions = 4;
using Gaps = std::array<double, positions + 2>;
Gaps gaps_of(const System& system, int i, const double* y) {
  const Plan<double>& plan = system.plan();
  const JointPlan<double>& joint = plan.joints[system.joint_of(i)];
  Gaps gaps;
  gaps.fill(std::numeric_limits<double>::quiet_NaN());
  const Resistance<double>& of = plan.resistances[system.joint_of(i)];
  const double limits[] = {of.lower, of.lower - of.width, of.upper, of.upper + of.width};
  const double speed = y[system.layout().qd[i]], reversal = 1 / of.per_velocity;
  for (std::size_t k = 0; joint.has_stops && k < positions; ++k) gaps[k] = y[i] - limits[k];
  if (joint.has_friction) gaps[positions] = speed - reversal, gaps[positions + 1] = speed + reversal;
  return gaps;
}

}  // namespace

bool has_backlash(const System& system) {
  for (const ElasticCouplingPlan& coupling : system.plan().elastic_couplings)
    if (coupling.half_play > 0) return true;
  const Actuators* actuators = system.actuators();
  for (int k = 0; actuators && k < actuators->size(); ++k)
    if (actuators->law(k).has_backlash()) return true;
  return false;
}

bool has_corners(const System& system) {
  for (const JointPlan<double>& joint : system.plan().joints)
    if (joint.has_resistance) return true;
  return has_backlash(system);
}

double time_to_corner(const System& system, const double* y, const double* slope) {
  double earliest = never;
  for (int i = 0; i < system.simple(); ++i) {
    if (!resists(system, i)) continue;
    const Gaps gaps = gaps_of(system, i, y);
    const int rate = system.layout().qd[i];
    for (std::size_t k = 0; k < gaps.size(); ++k) {
      const double time = k < positions ? time_to_close(gaps[k], y[rate], slope[rate])
                                        : time_to_close(gaps[k], slope[rate], 0);
      earliest = std::min(earliest, time);
    }
  }
  return earliest;
}

bool crosses_corner(const System& system, const double* before, const double* after) {
  for (int i = 0; i < system.simple(); ++i) {
    if (!resists(system, i)) continue;
    const Gaps from = gaps_of(system, i, before), to = gaps_of(system, i, after);
    for (std::size_t k = 0; k < from.size(); ++k)
      if (from[k] * to[k] < 0) return true;
  }
  return false;
}

}  // namespace redysim
