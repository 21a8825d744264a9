#include "integrate/system/contact_search.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/bias.hpp"
#include "dynamics/motion_subspace.hpp"

namespace redysim {
namespace {

constexpr double largest_turn = 0.5;  // rad, of a joint in a segment
constexpr int most_segments = 32;
constexpr double redysim_threshold = 1e-5;  // m

// The first root in (0, 1) of the cubic Hermite polynomial of f0 > 0, f1 and their slopes; 1: none.
double first_root(double f0, double slope0, double f1, double slope1) {
  constexpr int samples = 8;
  const auto value = [&](double u) {
    const double w = 1 - u;
    return w * w * (f0 * (1 + 2 * u) + slope0 * u) + u * u * (f1 * (1 + 2 * w) - slope1 * w);
  };
  double low = 0, high = 1;
  for (int k = 1; k <= samples; ++k) {
    high = static_cast<double>(k) / samples;
    if (value(high) < 0) break;
    low = high;
  }
  if (low == 1) return 1;
  for (int k = 0; k < 30; ++k) {
    const double middle = 0.5 * (low + high);
    (value(middle) < 0 ? high : low) = middle;
  }
  return high;
}

}  // namespace

ContactSearch::ContactSearch(const Plan<double>& plan)
    : start_q_(static_cast<std::size_t>(plan.nv)), start_qd_(start_q_), q_(start_q_), qd_(start_q_) {
  for (const ContactPair<double>& pair : plan.contact_pairs) {
    const ContactLaw<double>& law = plan.contact_laws[static_cast<std::size_t>(pair.contact)];
    pressed_.insert(pressed_.end(), pair.balls.size(), law.redysim ? redysim_threshold : law.width);
  }
  before_.resize(pressed_.size());
  after_.resize(pressed_.size());
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

double ContactSearch::step_to_touch(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                                    const double* qd, const double* qdd, double h) {
  std::copy_n(q, start_q_.size(), start_q_.begin());
  std::copy_n(qd, start_qd_.size(), start_qd_.begin());
  double turn = 0;
  for (std::size_t i = 0; i < start_q_.size(); ++i)
    if (turns(plan.joints[i])) turn = std::max(turn, h * (std::abs(qd[i]) + 0.5 * h * std::abs(qdd[i])));
  const int segments = static_cast<int>(std::clamp(std::ceil(turn / largest_turn), 1.0, 1.0 * most_segments));
  predict(plan, ws, qdd, 0, before_);
  for (int segment = 0; segment < segments; ++segment) {
    const double begin = h * segment / segments, length = h / segments;
    predict(plan, ws, qdd, begin + length, after_);
    double part = 1;
    for (std::size_t k = 0; k < before_.size(); ++k) {
      if (!(before_[k].value > 0)) continue;
      part = std::min(part, first_root(before_[k].value + pressed_[k], length * before_[k].rate,
                                       after_[k].value + pressed_[k], length * after_[k].rate));
    }
    if (part < 1) return begin + part * length;
    before_.swap(after_);
  }
  return h;
}

}  // namespace redysim
