#include "integrate/methods/given_state.hpp"

#include <algorithm>
#include <cmath>

#include "integrate/methods/methods.hpp"
#include "integrate/system/bytes.hpp"

namespace redysim {
namespace {

// Begins the bytes, which those of no method resemble.
constexpr double mark = 7.3e-217;

}  // namespace

GivenState::GivenState(const System& system)
    : layout_(system.layout()), y_(static_cast<std::size_t>(system.size())) {}

Outcome GivenState::start(double time, const double* y) {
  time_ = time;
  steps_ = 0;
  std::copy_n(y, y_.size(), y_.begin());
  normalise();
  return check_start(time, y_);
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

void GivenState::normalise(const StateLayout& layout, double* y) {
  for (int ball = 0; ball < layout.quaternion.count; ++ball)
    Eigen::Map<Eigen::Vector4d>(layout.quaternion.of(y, ball)).normalize();
}

bool GivenState::has_orientations(const StateLayout& layout, const double* y) {
  for (int ball = 0; ball < layout.quaternion.count; ++ball)
    if (!(Eigen::Map<const Eigen::Vector4d>(layout.quaternion.of(y, ball)).norm() > 1e-6)) return false;
  return true;
}

void GivenState::save(std::vector<unsigned char>& bytes) const {
  ByteWriter writer(bytes);
  writer.put(mark);
  writer.put(time_);
  writer.put(steps_);
  writer.put(y_.data(), y_.size());
}

bool GivenState::restore(const unsigned char* bytes, std::size_t size) {
  ByteReader reader(bytes, size);
  double marked = 0, time = 0;
  long steps = 0;
  std::vector<double> y(y_.size());
  reader.get(marked);
  reader.get(time);
  reader.get(steps);
  reader.get(y.data(), y.size());
  if (!reader.finished() || marked != mark || !check_start(time, y).ok ||
      !has_orientations(layout_, y.data()))
    return false;
  time_ = time;
  steps_ = steps;
  y_.swap(y);
  return true;
}

}  // namespace redysim
