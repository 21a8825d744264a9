#include "integrate/methods/given_state.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "integrate/methods/methods.hpp"
#include "integrate/system/bytes.hpp"

namespace redysim {
namespace {

// First value of a saved state; no other method begins with it.
constexpr double mark = 7.3e-217;

}  // namespace

GivenState::GivenState(const System& system, IndependentCoordinates& independent)
    : layout_(system.layout()),
      coordinates_(independent),
      y_(static_cast<std::size_t>(system.size())),
      independent_(2 * static_cast<std::size_t>(independent.count())),
      completed_(start_at(0, y_.data())),
      far_(completed_) {}

Outcome GivenState::start(double time, const double* y) {
  time_ = time;
  set_state(y);
  return check_start(time, y_);
}

void GivenState::set_state(const double* y) {
  std::copy_n(y, y_.size(), y_.begin());
  normalise();
  choose();
}

void GivenState::choose() {
  completed_ = far_ = start_at(time_, y_.data());
  coordinates_.choose(time_, y_.data());
  for (int k = 0; k < coordinates_.count(); ++k) {
    const IndependentCoordinates::Motion motion = coordinates_.motion(k, y_.data());
    double* const of_joint = independent_.data() + k;
    of_joint[0] = motion.q;
    of_joint[coordinates_.count()] = motion.qd;
  }
}

void GivenState::get(double* states) const {
  for (int i : coordinates_.kept()) *states++ = y_[static_cast<std::size_t>(i)];
  std::copy(independent_.begin(), independent_.end(), states);
}

bool GivenState::set(const double* states) {
  std::vector<double> y = y_;
  for (int i : coordinates_.kept()) y[static_cast<std::size_t>(i)] = *states++;
  if (!has_orientations(layout_, y.data())) return false;
  y_.swap(y);
  std::copy_n(states, independent_.size(), independent_.begin());
  return true;
}

bool GivenState::close(double time, double* y) {
  const bool closed = close_from(completed_, time, y);
  is_far_ = !closed || coordinates_.was_far();
  if (!is_far_) return true;
  if (completes_steps_ == 0) {
    if (!closed && !close_from(far_, time, y)) return false;
    follow(y);
    return close_from(completed_, time, y);
  }
  const std::vector<double> found(y, y + y_.size());
  const bool closed_again = close_from(far_, time, y);
  if (!closed && !closed_again) return false;
  if (closed && (!closed_again || coordinates_.was_far())) std::copy(found.begin(), found.end(), y);
  far_ = start_at(time, y);
  return close_from(far_, time, y);
}

bool GivenState::close_from(const Start& start, double time, double* y) {
  auto next = start.dependent.begin();
  for (int i : coordinates_.dependent()) y[i] = *next++;
  return coordinates_.close(time, independent_.data(), independent_.data() + coordinates_.count(),
                            start.driven, y);
}

GivenState::Start GivenState::start_at(double time, const double* y) const {
  Start start;
  for (int i : coordinates_.dependent()) start.dependent.push_back(y[i]);
  start.driven = coordinates_.driven(time, y);
  return start;
}

void GivenState::follow(const double* y) {
  for (int i : coordinates_.dependent()) y_[static_cast<std::size_t>(i)] = y[i];
  completed_ = start_at(time_, y);
}

void GivenState::keep(const double* y) {
  follow(y);
  far_ = completed_;
}

Outcome GivenState::advance(double, bool) { return failure(time_, "the master integrates"); }

double GivenState::stretch() const {
  double largest = 0;
  for (int ball = 0; ball < layout_.quaternion.count; ++ball) {
    const Eigen::Map<const Eigen::Vector4d> quaternion(layout_.quaternion.of(y_.data(), ball));
    largest = std::max(largest, std::abs(quaternion.norm() - 1));
  }
  return largest;
}

bool GivenState::has_orientations(const StateLayout& layout, const double* y) {
  for (int ball = 0; ball < layout.quaternion.count; ++ball)
    if (!has_orientation(layout.quaternion.of(y, ball))) return false;
  return true;
}

void GivenState::save(std::vector<unsigned char>& bytes) const {
  ByteWriter writer(bytes);
  writer.put(mark);
  writer.put(time_);
  writer.put(y_.data(), y_.size());
  writer.put(independent_.data(), independent_.size());
  writer.put(completes_steps_);
  for (const Start* start : {&completed_, &far_})
    for (const auto* part : {&start->dependent, &start->driven}) writer.put(part->data(), part->size());
  const std::vector<double> choice = coordinates_.choice();
  writer.put(choice.data(), choice.size());
}

bool GivenState::restore(const unsigned char* bytes, std::size_t size) {
  ByteReader reader(bytes, size);
  double marked = 0, time = 0;
  std::uint8_t completes = 0;
  bool finite = true;
  std::vector<double> y(y_.size()), independent(independent_.size()), choice = coordinates_.choice();
  Start completed = completed_, far = far_;
  reader.get(marked);
  reader.get(time);
  for (auto* part : {&y, &independent}) {
    reader.get(part->data(), part->size());
    finite = finite && check_start(time, *part).ok;
  }
  reader.get(completes);
  for (auto* part : {&completed.dependent, &completed.driven, &far.dependent, &far.driven, &choice}) {
    reader.get(part->data(), part->size());
    finite = finite && check_start(time, *part).ok;
  }
  if (!reader.finished() || marked != mark || !finite || !has_orientations(layout_, y.data()) ||
      !coordinates_.restore(choice))
    return false;
  time_ = time;
  y_.swap(y);
  independent_.swap(independent);
  completes_steps_ = completes;
  completed_ = std::move(completed);
  far_ = std::move(far);
  return true;
}

}  // namespace redysim
