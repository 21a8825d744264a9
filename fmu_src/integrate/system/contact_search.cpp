#include "integrate/system/contact_search.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/bias.hpp"
#include "dynamics/motion_subspace.hpp"

namespace redysim {
namespace {

constexpr double largest_turn = 0.5;  // rad, of a joint in a segment
constexpr double shortest = 1e-9;     // part of a step
constexpr double accurate = 0.9;      // part of a segment after which its cubic is accurate
constexpr double slightly = 0.01;     // of the width: next to no force
constexpr double deepening = 2;       // of the depth or the width in a step that presses

// A distance at both ends of a segment of length 1.
struct Course {
  double start, start_rate, end, end_rate;

  double at(double u) const {  // cubic Hermite polynomial
    const double w = 1 - u;
    return w * w * (start * (1 + 2 * u) + start_rate * u) + u * u * (end * (1 + 2 * w) - end_rate * w);
  }
  // Where start > 0 becomes end < 0.
  double root() const {
    double low = 0, high = 1;
    for (int k = 0; k < 40; ++k) {
      const double middle = 0.5 * (low + high);
      (at(middle) < 0 ? high : low) = middle;
    }
    return high;
  }
  // Whether it may be negative in between: distances from convex bodies are above their tangents.
  bool may_touch() const {
    if (!(start_rate < 0 && end_rate > 0)) return false;
    const double meeting = (end - start - end_rate) / (start_rate - end_rate);
    return start + start_rate * meeting < 0;
  }
};

}  // namespace

ContactSearch::ContactSearch(const Plan<double>& plan)
    : start_q_(static_cast<std::size_t>(plan.nv)), start_qd_(start_q_), q_(start_q_), qd_(start_q_) {
  for (const ContactPair<double>& pair : plan.contact_pairs) {
    const ContactLaw<double>& law = plan.contact_laws[static_cast<std::size_t>(pair.contact)];
    pressed_.insert(pressed_.end(), pair.balls.size(),
                    law.redysim ? redysim_least_depth : slightly * law.width);
  }
  before_.resize(pressed_.size());
  after_.resize(pressed_.size());
  touching_.resize(pressed_.size());
}

void ContactSearch::predict(const Plan<double>& plan, Workspace<double>& ws, const double* qdd, double after,
                            std::vector<ContactDistance>& distances) {
  for (std::size_t i = 0; i < q_.size(); ++i) {
    q_[i] = start_q_[i] + after * (start_qd_[i] + 0.5 * after * qdd[i]);
    qd_[i] = start_qd_[i] + after * qdd[i];
  }
  set_positions(plan, ws, q_.data());
  set_ground_motion(plan, ws, qd_.data());
  contact_distances(plan, ws, distances.data());
}

// Notes which points touch before_, and returns the step that does not press any of them much deeper.
double ContactSearch::note_touching(double h) {
  double longest = h;
  for (std::size_t k = 0; k < before_.size(); ++k) {
    touching_[k] = !(before_[k].value > 0);
    if (touching_[k] && before_[k].rate < 0)
      longest = std::min(longest,
                         deepening * std::max(-before_[k].value, pressed_[k] / slightly) / -before_[k].rate);
  }
  return longest;
}

double ContactSearch::step_to_touch(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                                    const double* qd, const double* qdd, double h) {
  std::copy_n(q, start_q_.size(), start_q_.begin());
  std::copy_n(qd, start_qd_.size(), start_qd_.begin());
  contact_distances(plan, ws, before_.data());
  h = note_touching(h);
  double turn = 0;
  for (std::size_t i = 0; i < start_q_.size(); ++i)
    if (turns(plan.joints[i]))
      turn = std::max(turn, h * (std::abs(start_qd_[i]) + 0.5 * h * std::abs(qdd[i])));
  const double longest = h / std::max(turn / largest_turn, 1.0);
  double begin = 0, length = longest;
  while (begin < h) {
    length = std::min(length, h - begin);
    predict(plan, ws, qdd, begin + length, after_);
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

// Of a segment between before_ and after_; 1: nothing touches, -1: it has to be shorter to tell.
double ContactSearch::part_to_touch(double length, bool may_be_shorter) const {
  double part = 1;
  for (std::size_t k = 0; k < before_.size(); ++k) {
    if (touching_[k]) continue;
    const Course course{before_[k].value + pressed_[k], length * before_[k].rate,
                        after_[k].value + pressed_[k], length * after_[k].rate};
    if (course.end < 0)
      part = std::min(part, course.root());
    else if (course.may_touch())
      return may_be_shorter ? -1 : part;
  }
  return part;
}

}  // namespace redysim
