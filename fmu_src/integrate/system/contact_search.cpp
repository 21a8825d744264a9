#include "integrate/system/contact_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/ball.hpp"
#include "dynamics/compiled.hpp"
#include "dynamics/contact/separation.hpp"
#include "dynamics/ground_motion.hpp"
#include "dynamics/motion_subspace.hpp"

namespace redysim {
namespace {

constexpr double largest_turn = 0.5;   // maximum rotation of a joint in a segment, rad
constexpr double largest_move = 0.5;   // maximum in a segment, relative to the spacing of a height map
constexpr int most_segments = 1000;    // a step that needs more is shortened
constexpr double shortest = 1e-9;      // minimum segment, relative to the step
constexpr double accurate = 0.9;       // relative end of a segment beyond which its cubic is accurate
constexpr double slightly = 0.01;      // relative to the width: almost no force
constexpr double before_jump = 0.999;  // relative to the depth at which ReDySim's force begins
constexpr double deepening = 2;        // maximum after a step, relative to the depth before or the width
constexpr double rising = 0.5;         // maximum rise in a step, relative to the depth before it or the width

}  // namespace

// A distance at both ends of a segment of length 1, and a bound of the change of the path's direction.
struct ContactSearch::Course {
  double start, start_rate, end, end_rate, bend;

  double at(double u) const {  // cubic Hermite polynomial
    const double w = 1 - u;
    return w * w * (start * (1 + 2 * u) + start_rate * u) + u * u * (end * (1 + 2 * w) - end_rate * w);
  }
  // The zero of a distance that is positive at 0 and negative at `high`.
  double root(double high = 1) const {
    double low = 0;
    for (int k = 0; k < 40; ++k) {
      const double middle = 0.5 * (low + high);
      (at(middle) < 0 ? high : low) = middle;
    }
    return high;
  }
  // Where the distance becomes zero if it is positive at both ends and negative in between; otherwise 1.
  double passed_root() const {
    const double a = 2 * (start - end) + start_rate + end_rate,
                 b = 3 * (end - start) - 2 * start_rate - end_rate;
    const double discriminant = b * b - 3 * a * start_rate;
    if (!(end > 0 && start_rate < 0 && end_rate > 0 && discriminant > 0)) return 1;
    const double lowest = -start_rate / (b + std::sqrt(discriminant));
    if (!(lowest > 0 && lowest < 1 && at(lowest) < 0)) return 1;
    return root(lowest);
  }
  // Whether the distance may be negative in between. On a line, distances from convex bodies lie above their
  // tangents, on other paths above parabolas.
  bool may_touch() const {
    const double meeting = (start - end + end_rate + 0.5 * bend) / (end_rate - start_rate + bend);
    return meeting > 0 && meeting < 1 && start + (start_rate - 0.5 * bend * meeting) * meeting < 0;
  }
};

ContactSearch::ContactSearch(const Plan<double>& plan)
    : start_q_(static_cast<std::size_t>(plan.nv)),
      start_qd_(start_q_),
      q_(start_q_),
      qd_(start_q_),
      reference_q_(start_q_.size(), std::numeric_limits<double>::quiet_NaN()),
      arms_(plan.joints.size()),
      reference_pairs_(plan.contact_pairs.size()),
      displacements_(plan.joints.size()) {
  for (const ContactPair<double>& pair : plan.contact_pairs) {
    const ContactLaw<double>& law = plan.contact_laws[static_cast<std::size_t>(pair.contact)];
    pressed_.insert(pressed_.end(), pair.spheres.size(),
                    law.redysim ? before_jump * redysim_least_depth : slightly * law.width);
  }
  near_.reserve(plan.contact_pairs.size());
  waiting_.reserve(pressed_.size());
  before_.resize(pressed_.size());
  after_.resize(pressed_.size());
  start_.resize(pressed_.size());
}

// Spherical joints: constant angular acceleration in link axes, since the angles of a spinning body vary
// fast.
void ContactSearch::predict_balls(const Plan<double>& plan, const double* qdd, double after) {
  for (const int chart : plan.balls) {
    const double* q = &start_q_[chart + 1];
    const BallAngles start{start_q_[chart] != 0, q[0], q[1], q[2]};
    const Vec3<double> rates(&start_qd_[chart + 1]), accelerations(qdd + chart + 1);
    const Mat3<double> E = rate_matrix(start);
    const Vec3<double> omega = E * rates, alpha = E * accelerations + rate_bias(start, rates);
    const Vec3<double> turn = after * (omega + 0.5 * after * alpha);
    const double angle = safe_norm(turn);
    const BallAngles end =
        ball_angles(rotation_of(start) * Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix());
    const Vec3<double> end_rates = angle_rates(end, Vec3<double>(omega + after * alpha));
    std::copy_n(joint_positions(end).begin(), 4, &q_[chart]);
    std::copy_n(end_rates.data(), 3, &qd_[chart + 1]);
  }
}

// Sets the ground motion predicted for `after` s after the start.
void ContactSearch::predict(const Plan<double>& plan, Workspace<double>& ws, const double* qdd,
                            double after) {
  for (std::size_t i = 0; i < q_.size(); ++i) {
    q_[i] = start_q_[i] + after * (start_qd_[i] + 0.5 * after * qdd[i]);
    qd_[i] = start_qd_[i] + after * qdd[i];
  }
  if (after > 0) predict_balls(plan, qdd, after);
  compiled_ground_motion(plan, ws, q_.data(), qd_.data());
}

// Upper bound of the change of a joint in `h` s.
double ContactSearch::travel(std::size_t joint, const double* qdd, double h) const {
  return h * (std::abs(start_qd_[joint]) + 0.5 * h * std::abs(qdd[joint]));
}

// Makes the start of the step the reference; uses the ground poses there.
void ContactSearch::set_reference(const Plan<double>& plan, const Workspace<double>& ws) {
  reference_q_ = start_q_;
  for (const PoseStep& step : plan.poses)
    if (step.kind == PoseStep::Kind::moved)
      arms_[step.body] = (ws.ground[step.entry].position - ground_state(ws, step.from).position).norm();
  for (std::size_t k = 0; k < reference_pairs_.size(); ++k) {
    const ContactPair<double>& pair = plan.contact_pairs[k];
    const GroundState<double>& body = ground_state(ws, pair.sphere_entry);
    const Vec3<double> middle = body.position + body.rotation * pair.middle;
    const Vec3<double>& carrier = ground_state(ws, pair.surface_entry).position;
    reference_pairs_[k] = {separation(pair, ws), (middle - carrier).norm()};
  }
}

// Selects near_, the pairs that may touch in a step of `h` s from the start. False: there are none.
bool ContactSearch::find_near_pairs(const Plan<double>& plan, const double* qdd, double h) {
  for (const PoseStep& step : plan.poses) {
    if (step.kind != PoseStep::Kind::moved) continue;
    const int i = step.body;
    const JointPlan<double>& joint = plan.joints[i];
    const double change = std::abs(start_q_[i] - reference_q_[i]) + travel(i, qdd, h);
    const Displacement parent = displacement_of(joint.parent);
    displacements_[i] = {parent.of_point(arms_[i]) + std::abs(advance(joint)) * change,
                         parent.turned + (turns(joint) ? change : 0)};
  }
  near_.clear();
  std::size_t first_point = 0;
  for (std::size_t k = 0; k < reference_pairs_.size(); ++k) {
    const ContactPair<double>& pair = plan.contact_pairs[k];
    const ReferencePair& at = reference_pairs_[k];
    const Displacement body = displacement_of(pair.sphere_body), carrier = displacement_of(pair.surface_body);
    const double moved = body.of_point(pair.middle_arm) + carrier.of_point(at.carrier_arm);
    if (!(at.separation > moved))
      near_.push_back(
          {&pair, first_point, moved + std::min(body.turned + carrier.turned, 2.0) * pair.extent});
    first_point += pair.spheres.size();
  }
  return !near_.empty();
}

void ContactSearch::set_distances(const Workspace<double>& ws, std::vector<ContactDistance>& distances) {
  for (const NearPair& near : near_) contact_distances(*near.pair, ws, &distances[near.first_point]);
}

// Selects the pairs with points that may begin to touch. Returns the step, s, in which no touching point
// becomes much deeper or, if requested, rises much.
double ContactSearch::find_waiting_points(double h, bool or_separation) {
  double longest = h;
  std::size_t kept = 0;
  for (const NearPair& near : near_) {
    const std::size_t waiting_before = waiting_.size();
    // in a height map, the depth may change more than the point moves
    const bool bounded = near.pair->surface.kind != ShapeKind::heightmap;
    for (std::size_t k = near.first_point; k < near.first_point + near.pair->spheres.size(); ++k) {
      const ContactDistance& at = before_[k];
      if (at.value > 0) {
        if (!bounded || !(at.value > near.moved)) waiting_.push_back(k);
      } else if (at.rate < 0) {
        const double deepest = deepening * std::max(-at.value, pressed_[k] / slightly);
        longest = std::min(longest, deepest / -at.rate);
      } else if (or_separation && at.rate > 0) {
        const double rise = rising * std::max(-at.value, pressed_[k] / slightly);
        longest = std::min(longest, rise / at.rate);
      }
    }
    if (waiting_.size() != waiting_before) near_[kept++] = near;
  }
  near_.erase(near_.begin() + static_cast<std::ptrdiff_t>(kept), near_.end());
  return longest;
}

double ContactSearch::step_to_touch(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                                    const double* qd, const double* qdd, double h, bool or_separation) {
  std::copy_n(q, start_q_.size(), start_q_.begin());
  std::copy_n(qd, start_qd_.size(), start_qd_.begin());
  waiting_.clear();
  if (!find_near_pairs(plan, qdd, h)) return h;
  predict(plan, ws, qdd, 0);
  set_reference(plan, ws);
  if (!find_near_pairs(plan, qdd, h)) return h;
  set_distances(ws, before_);
  h = find_waiting_points(h, or_separation);
  for (const std::size_t k : waiting_) start_[k] = before_[k];
  return waiting_.empty() ? h : search(plan, ws, qdd, h);
}

double ContactSearch::passed_touch(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                                   const double* qd, double h) {
  if (waiting_.empty()) return h;
  compiled_ground_motion(plan, ws, q, qd);
  set_distances(ws, after_);
  double part = 1;
  for (const std::size_t k : waiting_) part = std::min(part, course(start_[k], k, h).passed_root());
  return part * h;
}

double ContactSearch::search(const Plan<double>& plan, Workspace<double>& ws, const double* qdd, double h) {
  double parts = 1;
  for (std::size_t i = 0; i < start_q_.size(); ++i)
    if (turns(plan.joints[i])) parts = std::max(parts, travel(i, qdd, h) / largest_turn);
  for (const NearPair& near : near_)
    if (const BicubicSpline* heights = near.pair->surface.heights)
      parts = std::max(parts, near.moved / (largest_move * heights->spacing()));
  const double longest = h / parts;
  double begin = 0, length = longest;
  for (int segment = 0; begin < h; ++segment) {
    if (segment > most_segments && begin > 0) return begin;
    length = std::min(length, h - begin);
    predict(plan, ws, qdd, begin + length);
    set_distances(ws, after_);
    const bool may_be_shorter = length > shortest * h;
    const double part = part_to_touch(length, may_be_shorter);
    if (part < (may_be_shorter ? accurate : 0)) {
      length *= part < 0 ? 0.5 : part;
      continue;
    }
    if (part < 1) return begin + part * length;
    begin += length;
    length = std::min(2 * length, longest);
    before_.swap(after_);
  }
  return h;
}

// Path of a point from `from` to after_ in `length` s.
ContactSearch::Course ContactSearch::course(const ContactDistance& from, std::size_t point,
                                            double length) const {
  const ContactDistance& to = after_[point];
  return {from.value + pressed_[point], length * from.rate, to.value + pressed_[point], length * to.rate,
          length * (to.velocity - from.velocity).norm()};
}

// Part of the segment between before_ and after_ until a point touches; 1: none touches, -1: the segment is
// too long to decide.
double ContactSearch::part_to_touch(double length, bool may_be_shorter) const {
  double part = 1;
  for (const std::size_t k : waiting_) {
    const Course path = course(before_[k], k, length);
    if (path.end < 0)
      part = std::min(part, path.root());
    else if (path.may_touch())
      return may_be_shorter ? -1 : part;
  }
  return part;
}

}  // namespace redysim
