#include "integrate/methods/force_corners.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "dynamics/elastic_coupling.hpp"

namespace redysim {
namespace {

constexpr double rounding = 1e-15;
constexpr double never = std::numeric_limits<double>::infinity();

// Time, s, until a gap of either sign is zero.
double time_to_close(double gap, double rate, double acceleration) {
  const double way = std::fabs(gap), side = gap < 0 ? 1 : -1, speed = side * rate;
  const double towards = speed + std::sqrt(speed * speed + 2 * side * acceleration * way);
  return towards > 0 ? 2 * way / towards : never;
}

template <class Visit>
void each_actuator(const System& system, Visit visit) {
  const Actuators* actuators = system.actuators();
  for (int k = 0; actuators && k < actuators->size(); ++k) visit(*actuators, k);
}

// A coordinate and its rate.
struct Moving {
  double value, rate;
};

// A coordinate inside an interval (low, high), which it may leave by more than the tolerance.
struct Bounded {
  double low, high, tolerance;
};

// A step of a coordinate, by the cubic polynomial through positions and velocities. Its velocity at the share
// s of the step: rate + b s + c s^2.
class Step {
 public:
  Step(const Moving& begin, const Moving& end, double h)
      : begin_(begin),
        end_(end),
        h_(h),
        c_(3 * (begin.rate + end.rate - 2 * (end.value - begin.value) / h)),
        b_(end.rate - begin.rate - c_) {}

  // Share of the step after which the position is farthest outside its bounds, in which it begins and ends;
  // infinity: it stays inside.
  double share_outside(const Bounded& bounds) const {
    if (!(begin_.rate * end_.rate < 0)) return never;
    const double rate = begin_.rate,
                 root = std::copysign(std::sqrt(std::max(0.0, b_ * b_ - 4 * c_ * rate)), rate);
    // without cancellation; the velocity passes zero towards the other side
    const double s = b_ * rate < 0 ? 2 * rate / (root - b_) : (-b_ - root) / (2 * c_);
    const double turn = begin_.value + h_ * s * (rate + s * (b_ / 2 + s * c_ / 3));
    return leaves(begin_.value, end_.value, turn, bounds) ? s : never;
  }

  // The same for the velocity, to which rounding errors of the positions contribute.
  double share_outside_by_rate(Bounded bounds) const {
    const double s = -b_ / (2 * c_);
    bounds.tolerance += rounding * (std::fabs(begin_.value) + std::fabs(end_.value)) / h_;
    const bool turns = 0 < s && s < 1;
    return turns && leaves(begin_.rate, end_.rate, begin_.rate + s * b_ / 2, bounds) ? s : never;
  }

 private:
  // `turn`: the value farthest from both ends.
  static bool leaves(double from, double to, double turn, const Bounded& bounds) {
    constexpr double error = 0.05;  // of `turn`, relative to its distance from both ends
    const double side = turn > from ? 1 : -1, limit = turn > from ? bounds.high : -bounds.low;
    const double last = std::max(side * from, side * to), farthest = side * turn;
    return last < limit && farthest + error * (farthest - last) > limit + bounds.tolerance;
  }

  Moving begin_, end_;
  double h_, c_, b_;
};

// Combines the regions of several force laws into one code.
struct Regions {
  std::uint64_t code = 0;
  void append(unsigned region) { code = 0x9e3779b97f4a7c15u * code + region; }
};

bool resists(const System& system, int i) { return system.plan().joints[system.joint_of(i)].has_resistance; }

// Distances of a joint, index into the plan, to the corners of its force: positions to the beginning and end
// of the contact with its stops, then velocities to the beginning and end of a reversal against friction.
// NaN: none.
constexpr std::size_t positions = 4;
using Gaps = std::array<double, positions + 2>;
Gaps gaps_of(const Plan<double>& plan, int joint, const Moving& at) {
  Gaps gaps;
  gaps.fill(std::numeric_limits<double>::quiet_NaN());
  const Resistance<double>& of = plan.resistances[joint];
  const double limits[] = {of.lower, of.lower - of.width, of.upper, of.upper + of.width};
  const double reversal = 1 / of.per_velocity;
  for (std::size_t k = 0; plan.joints[joint].has_stops && k < positions; ++k) gaps[k] = at.value - limits[k];
  if (plan.joints[joint].has_friction)
    gaps[positions] = at.rate - reversal, gaps[positions + 1] = at.rate + reversal;
  return gaps;
}

// Twist of the gear of actuator k for the position of its motor and those of all joints, or its rate for
// their velocities.
double twist(const Actuators& actuators, int k, double motor, const double* joints) {
  return motor / actuators.law(k).gear_ratio - joints[actuators.joint(k)];
}

std::uint64_t regions_of_state(System& system, double time, const double* y, unsigned kinds) {
  Regions regions;
  if ((kinds & Corners::of_state) == 0) return regions.code;
  const Plan<double>& plan = system.plan();
  const System::Coordinates at = system.coordinates(time, y);
  // of prescribed joints, too: the work that moves them is integrated
  for (int joint = 0; joint < plan.nv; ++joint) {
    if (!plan.joints[joint].has_resistance) continue;
    unsigned beyond = 0;
    for (double gap : gaps_of(plan, joint, {at.q[joint], at.qd[joint]}))
      beyond = 2 * beyond + (gap > 0 ? 1 : 0);
    regions.append(beyond);
  }
  for (const ElasticCouplingPlan& coupling : system.plan().elastic_couplings)
    if (coupling.half_play > 0)
      regions.append(coupling.region(coupling_sum(coupling, at.q, coupling.offset)));
  each_actuator(system, [&](const Actuators& actuators, int k) {
    const Actuator& law = actuators.law(k);
    if (law.has_backlash())
      regions.append(gear_law(law).region(twist(actuators, k, y[actuators.places(k).motor_q], at.q)));
  });
  return regions.code;
}

// Regions between the limits of actuators, with their inputs at the last right-hand side.
std::uint64_t regions_of_limits(System& system, double time, const double* y) {
  Regions regions;
  if (!system.actuators()) return regions.code;
  const System::Coordinates at = system.coordinates(time, y);
  each_actuator(system, [&](const Actuators& actuators, int k) {
    const int joint = actuators.joint(k);
    regions.append(
        limit_region(actuators.law(k), actuators.point(k, y, at.q[joint], at.qd[joint], actuators.input(k))));
  });
  return regions.code;
}

Moving sum_of(const ElasticCouplingPlan& coupling, const System::Coordinates& at) {
  return {coupling_sum(coupling, at.q, coupling.offset), coupling_sum(coupling, at.qd, 0.0)};
}

Moving twist_of(const System::Coordinates& at, const Actuators& actuators, int k, const double* y) {
  const auto places = actuators.places(k);
  return {twist(actuators, k, y[places.motor_q], at.q), twist(actuators, k, y[places.motor_qd], at.qd)};
}

// A step of the whole state.
struct WholeStep {
  double begin_time, end_time;
  const double *begin, *end;
};

// The interval between the corners of friction, -reversal and reversal, that contains a velocity.
Bounded between_reversals(double speed, double reversal, double tolerance) {
  const double low = speed > reversal ? reversal : speed < -reversal ? -never : -reversal;
  const double high = speed > reversal ? never : speed < -reversal ? -reversal : reversal;
  return {low, high, tolerance};
}

// CornerWatch::time_of_short_touch as a share of the step, for stops and friction.
double share_in_joints(const System& system, const WholeStep& step, const double* weights) {
  const StateLayout& layout = system.layout();
  double earliest = never;
  for (int i = 0; i < system.simple(); ++i) {
    if (!resists(system, i)) continue;
    const int joint = system.joint_of(i), position = layout.q[i], rate = layout.qd[i];
    const Resistance<double>& of = system.plan().resistances[joint];
    const Step own({step.begin[position], step.begin[rate]}, {step.end[position], step.end[rate]},
                   step.end_time - step.begin_time);
    if (system.plan().joints[joint].has_stops)
      earliest = std::min(earliest, own.share_outside({of.lower, of.upper, 1 / weights[position]}));
    // the projection of loops changes positions, and thereby the mean velocity of short steps
    if (system.plan().joints[joint].has_friction && !system.has_constraints())
      earliest = std::min(earliest, own.share_outside_by_rate(between_reversals(
                                        step.begin[rate], 1 / of.per_velocity, 1 / weights[rate])));
  }
  return earliest;
}

// CornerWatch::time_of_short_touch as a share of the step, for the play of an elastic law.
double share_beyond_play(const ElasticLaw& law, const Step& step) {
  constexpr double negligible = 1e-6;  // depth relative to the width of the onset
  return step.share_outside({-law.half_play, law.half_play, negligible * law.width});
}

// The same for all couplings and gears.
double share_beyond_plays(System& system, const WholeStep& step) {
  const double h = step.end_time - step.begin_time;
  double earliest = never;
  for (const ElasticCouplingPlan& coupling : system.plan().elastic_couplings) {
    if (!(coupling.half_play > 0)) continue;
    const Moving before = sum_of(coupling, system.coordinates(step.begin_time, step.begin)),
                 after = sum_of(coupling, system.coordinates(step.end_time, step.end));
    earliest = std::min(earliest, share_beyond_play(coupling, {before, after, h}));
  }
  each_actuator(system, [&](const Actuators& of, int k) {
    if (!of.law(k).has_backlash()) return;
    const Moving before = twist_of(system.coordinates(step.begin_time, step.begin), of, k, step.begin),
                 after = twist_of(system.coordinates(step.end_time, step.end), of, k, step.end);
    earliest = std::min(earliest, share_beyond_play(gear_law(of.law(k)), {before, after, h}));
  });
  return earliest;
}

}  // namespace

unsigned corners_of(const System& system) {
  unsigned kinds = system.plan().has_contacts() * Corners::of_evaluation;
  for (const ContactLaw<double>& law : system.plan().contact_laws) kinds |= law.redysim * Corners::jumps;
  for (const JointPlan<double>& joint : system.plan().joints)
    kinds |= joint.has_stops * Corners::stops | joint.has_friction * Corners::friction;
  for (const ElasticCouplingPlan& coupling : system.plan().elastic_couplings)
    kinds |= (coupling.half_play > 0) * Corners::backlash;
  each_actuator(system, [&](const Actuators& of, int k) {
    const Actuator& law = of.law(k);
    kinds |= law.has_backlash() * Corners::backlash | law.has_limits() * Corners::of_evaluation;
  });
  return kinds;
}

double time_to_corner(const System& system, const double* y, const double* slope) {
  double earliest = never;
  for (int i = 0; i < system.simple(); ++i) {
    if (!resists(system, i)) continue;
    const int rate = system.layout().qd[i];
    const Gaps gaps = gaps_of(system.plan(), system.joint_of(i), {y[i], y[rate]});
    for (std::size_t k = 0; k < gaps.size(); ++k) {
      const double time = k < positions ? time_to_close(gaps[k], y[rate], slope[rate])
                                        : time_to_close(gaps[k], slope[rate], 0);
      earliest = std::min(earliest, time);
    }
  }
  return earliest;
}

double CornerWatch::time_of_short_touch(System& system, double time, const double* y,
                                        const double* weights) const {
  if (!expects_touches()) return never;
  const WholeStep step{begin_time_, time, begin_y_.data(), y};
  const double share = std::min(share_in_joints(system, step, weights), share_beyond_plays(system, step));
  return begin_time_ + share * (time - begin_time_);
}

void CornerWatch::begin(System& system, double time, const double* y) {
  kinds_ = corners_of(system);
  if (kinds_ == 0) return;
  of_state_ = regions_of_state(system, time, y, kinds_);
  contacts_ = system.contact_regions();
  begin_time_ = time;
  std::copy_n(y, begin_y_.size(), begin_y_.begin());
}

void CornerWatch::note(System& system, double time, const double* y) {
  if (!watches() || crosses_) return;
  const std::uint64_t limits = regions_of_limits(system, time, y);
  if (!noted_) limits_ = limits;
  noted_ = true;
  crosses_ = limits != limits_ || system.contact_regions() != contacts_ ||
             regions_of_state(system, time, y, kinds_) != of_state_;
}

bool CornerWatch::crosses(System& system, double time, const double* y) const {
  return watches() && (crosses_ || regions_of_state(system, time, y, kinds_) != of_state_);
}

}  // namespace redysim
