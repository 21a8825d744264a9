#include "integrate/system/equilibrium.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/ball.hpp"
#include "integrate/system/dense_jacobian.hpp"
#include "integrate/system/dense_lu.hpp"

namespace redysim {
namespace {

// Step lengths, s^2: initial, maximum and minimum
constexpr double first_length = 1e-4, longest = 1e8, shortest = 1e-14;
constexpr double largest_change = 0.2;  // maximum change of a joint in a step, relative to its scale
constexpr double accurate = 1e-11;      // change in a step of maximum length
constexpr double of_weights = 1e-13;    // rounding error of balanced weights, relative to gravity
// rounding errors of accelerations: measured `probes` times at distances of `probe` times the scales
constexpr double probe = 1e-13, uncertainty = 8;
constexpr int probes = 3, most_steps = 2000;

class RestSearch {
 public:
  RestSearch(System& system, const std::vector<double>& scales, double time, double* y)
      : system_(system),
        time_(time),
        y_(y),
        first_velocity_(static_cast<std::size_t>(system.nq())),
        count_(static_cast<std::size_t>(system.nv())),
        jacobian_(system),
        matrix_(static_cast<std::size_t>(system.size()) * static_cast<std::size_t>(system.size())),
        tangent_(count_ * count_),
        factors_(tangent_),
        slope_(static_cast<std::size_t>(system.size())),
        before_(slope_),
        step_(count_),
        scales_(scales),
        columns_(count_),
        pivots_(count_) {
    scales_.resize(count_, 1.0);
    for (std::size_t k = 0; k < count_; ++k) columns_[k] = &factors_[k * count_];
  }

  RestSearch(const RestSearch&) = delete;
  RestSearch& operator=(const RestSearch&) = delete;
  ~RestSearch() { rest_actuators(false); }

  // `along_stiff`: the steps do not become short where stiff directions alone accelerate, as on a curve that
  // a stiff spring prescribes. It fails more often elsewhere.
  [[gnu::cold, gnu::noinline]] Rest find(bool along_stiff);

 private:
  void rest_actuators(bool resting) {
    if (system_.actuators()) system_.actuators()->rest(resting);
  }
  bool evaluate();
  bool linearise();
  bool solve();
  bool move();
  void substitute();
  bool settled(double change);
  bool is_rounding();
  void displace(const double* step, double* y) const;
  double product(const double* a, const double* b);
  Rest none_near() const;
  double scaled(const double* values, std::size_t k) const { return std::abs(values[k]) / scales_[k]; }
  std::size_t largest(const double* values) const {
    std::size_t largest = 0;
    for (std::size_t k = 1; k < count_; ++k)
      if (scaled(values, k) > scaled(values, largest)) largest = k;
    return largest;
  }
  double scaled(const double* values) const { return scaled(values, largest(values)); }

  System& system_;
  double time_;
  double* y_;
  std::size_t first_velocity_, count_;  // start and number of the velocities in y
  DenseJacobian jacobian_;
  std::vector<double> matrix_, tangent_, factors_, slope_, before_, step_, scales_;
  std::vector<double*> columns_;
  std::vector<std::int64_t> pivots_;
  double length_ = first_length;  // step length, s^2
  double size_ = 0;               // scaled accelerations
  int rank_ = 0;                  // of the loop constraints
};

// Computes the accelerations at y.
bool RestSearch::evaluate() {
  if (system_.slope_within_step(time_, y_, slope_.data()) != Status::ok) return false;
  size_ = scaled(&slope_[first_velocity_]);
  rank_ = system_.independent_rows();
  return true;
}

// Sets tangent_ to the derivatives of the accelerations by the positions, within the loop constraints;
// coordinates of spherical joints are rotation vectors.
bool RestSearch::linearise() {
  if (jacobian_.evaluate(time_, y_, matrix_.data()) != Status::ok) return false;
  const StateLayout& layout = system_.layout();
  const auto add = [&](int column, int position, double factor) {
    const double* from = &matrix_[static_cast<std::size_t>(position) * slope_.size() + first_velocity_];
    for (std::size_t i = 0; i < count_; ++i) tangent_[column * count_ + i] += factor * from[i];
  };
  std::fill(tangent_.begin(), tangent_.end(), 0.0);
  for (int k = 0; k < system_.simple(); ++k) add(k, layout.q[k], 1);
  for (int ball = 0; ball < system_.balls(); ++ball) {
    for (int axis = 0; axis < 3; ++axis) {
      double unit[3] = {0, 0, 0}, rate[4];
      unit[axis] = 1;
      quaternion_rate(layout.quaternion.of(y_, ball), unit, rate);
      for (int k = 0; k < 4; ++k)
        add(layout.omega[ball] + axis - system_.nq(), layout.quaternion[ball] + k, rate[k]);
    }
  }
  for (std::size_t k = 0; k < count_; ++k) system_.project_velocity(&tangent_[k * count_]);
  return true;
}

// Solves for the implicit step. False: it is too long and passes one or more unstable directions.
bool RestSearch::solve() {
  for (std::size_t i = 0; i < tangent_.size(); ++i) factors_[i] = -tangent_[i];
  for (std::size_t k = 0; k < count_; ++k) columns_[k][k] += 1 / length_;
  if (!factor_lu(columns_.data(), static_cast<std::int64_t>(count_), pivots_.data())) return false;
  bool positive = true;  // sign of the determinant
  for (std::size_t k = 0; k < count_; ++k)
    if ((pivots_[k] != static_cast<std::int64_t>(k)) != (columns_[k][k] < 0)) positive = !positive;
  if (!positive) return false;
  substitute();
  return product(step_.data(), &slope_[first_velocity_]) >= 0;
}

// Sets step_ to the implicit step by the factors of the last `solve`.
void RestSearch::substitute() {
  std::copy_n(&slope_[first_velocity_], count_, step_.begin());
  solve_lu(columns_.data(), static_cast<std::int64_t>(count_), pivots_.data(), step_.data());
}

// Product of two directions in the mass metric, in which the accelerations of conservative forces have a
// symmetric derivative; up to a positive factor, by energies.
double RestSearch::product(const double* a, const double* b) {
  const double of_a = scaled(a), of_b = scaled(b);
  if (of_a == 0 || of_b == 0) return 0;
  double difference = 0;
  for (const double sign : {1.0, -1.0}) {
    std::copy_n(y_, before_.size(), before_.begin());
    for (std::size_t k = 0; k < count_; ++k) before_[first_velocity_ + k] = a[k] / of_a + sign * b[k] / of_b;
    difference += sign * system_.kinetic_energy(time_, before_.data());
  }
  return difference;
}

// Adds a step to the positions of y.
void RestSearch::displace(const double* step, double* y) const {
  const StateLayout& layout = system_.layout();
  for (int k = 0; k < system_.simple(); ++k) y[layout.q[k]] += step[k];
  for (int ball = 0; ball < system_.balls(); ++ball) {
    double rate[4], *quaternion = layout.quaternion.of(y, ball), squared = 0;
    quaternion_rate(quaternion, &step[layout.omega[ball] - system_.nq()], rate);
    for (int k = 0; k < 4; ++k) quaternion[k] += rate[k];
    for (int k = 0; k < 4; ++k) squared += quaternion[k] * quaternion[k];
    for (int k = 0; k < 4; ++k) quaternion[k] /= std::sqrt(squared);
  }
}

// Moves y by step_ and projects it onto the loops.
bool RestSearch::move() {
  displace(step_.data(), y_);
  if (system_.project(time_, y_, nullptr) != Status::ok) return false;
  std::fill_n(y_ + first_velocity_, count_, 0.0);
  return evaluate();
}

bool RestSearch::settled(double change) {
  return is_rounding() || (length_ == longest && change <= accurate);
}

// Whether each acceleration is a rounding error: no larger than what its linear change does not explain at
// positions nearby. The size of all does not decide: those of stiff and light joints would hide others. Nor
// does a change of the rank, which is large close to a singular configuration.
bool RestSearch::is_rounding() {
  double* const probed = matrix_.data();  // its content is in tangent_
  const double *const now = &slope_[first_velocity_], *const nearby = probed + first_velocity_;
  std::vector<double> noise(2 * count_);
  double* const step = &noise[count_];
  for (int trial = 0; trial < probes; ++trial) {
    for (std::size_t k = 0; k < count_; ++k)
      step[k] = (k >> trial & 1) != 0 ? probe * scales_[k] : -probe * scales_[k];
    std::copy_n(y_, before_.size(), before_.begin());
    displace(step, before_.data());
    if (system_.slope_within_step(time_, before_.data(), probed) != Status::ok ||
        system_.independent_rows() != rank_)
      return false;
    for (std::size_t i = 0; i < count_; ++i) {
      double change = nearby[i] - now[i];
      for (std::size_t k = 0; k < count_; ++k) change -= tangent_[k * count_ + i] * step[k];
      noise[i] = std::max(noise[i], std::abs(change));
    }
  }
  const double gravity = system_.plan().gravity.norm() / *std::max_element(scales_.begin(), scales_.end());
  for (std::size_t i = 0; i < count_; ++i)
    if (!(std::abs(now[i]) <= uncertainty * noise[i] + of_weights * gravity * scales_[i])) return false;
  return true;
}

Rest RestSearch::none_near() const {
  const double* accelerations = &slope_[first_velocity_];
  const std::size_t worst = largest(accelerations);
  system_.set_failed_joint(static_cast<int>(worst));
  Rest rest{Rest::End::none_near, system_.failed_joint(), accelerations[worst]};
  system_.forget_failure();
  return rest;
}

Rest RestSearch::find(bool along_stiff) {
  rest_actuators(true);
  double limit = largest_change;
  if (!evaluate()) return none_near();
  for (int k = 0; k < most_steps; ++k) {
    if (!linearise()) break;
    length_ = std::min(length_, largest_change / size_);
    while (!solve() && length_ > shortest) length_ *= 0.25;
    const double change = scaled(step_.data());
    if (settled(change)) return {};
    if (change > limit)
      for (double& part : step_) part *= limit / change;
    const double size_before = size_;
    std::copy_n(y_, before_.size(), before_.begin());
    if (!move()) {
      std::copy(before_.begin(), before_.end(), y_);
      limit *= 0.25;
      if (!(limit > accurate) || !evaluate()) break;
      continue;
    }
    limit = std::min(largest_change, 2 * limit);
    if (along_stiff) {
      substitute();
      size_ = std::min(size_, scaled(step_.data()) / length_);
    }
    length_ = std::clamp(length_ * std::clamp(2 * size_before / size_, 1.0 / 64, 8.0), shortest, longest);
  }
  return none_near();
}

}  // namespace

Rest find_rest(System& system, const std::vector<double>& scales, double time, double* y) {
  const Plan<double>& plan = system.plan();
  const System::Coordinates at = system.coordinates(time, y);
  for (int i = 0; i < plan.nv; ++i)
    if (at.qd[i] != 0)
      return {plan.joints[i].prescribed ? Rest::End::motion_moves : Rest::End::start_moves, i, 0};
  if (system.nv() == 0) return {};
  std::vector<double> given(y, y + system.size());
  const auto search = [&](bool along_stiff) {
    const Rest rest = RestSearch(system, scales, time, y).find(along_stiff);
    if (rest.end != Rest::End::found) std::copy(given.begin(), given.end(), y);
    return rest;
  };
  Rest rest = search(false);
  if (rest.end != Rest::End::found) rest = search(true);
  if (system.actuators()) system.actuators()->set_rest(y);
  return rest;
}

}  // namespace redysim
