#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "integrate/methods/one_step.hpp"
#include "integrate/methods/phi_functions.hpp"
#include "integrate/system/dense_lu.hpp"

// An exponential Rosenbrock method: the equations linearised at the start of a step are solved exactly, so
// fast vibrations of small amplitude do not limit the step size. exprb43 of order 4 with an error estimate of
// order 3 (Hochbruck, Ostermann, Schweitzer, SIAM J. Numer. Anal. 47, 2009):
//
//     D(u) = f(u) - f(y) - J (u - y)
//     u2 = y + h/2 phi_1(h J / 2) f
//     u3 = y + h phi_1 (f + D(u2))
//     y1 = y + h phi_1 f + h phi_3 (16 D(u2) - 2 D(u3)) + h phi_4 (12 D(u3) - 48 D(u2)),
//
// whose last term is the error estimate. If f depends on time, the time derivative v = df/dt adds h^2 phi_2
// v, and D is that of the system with time as a state.

namespace redysim {
namespace {

constexpr double tightening = 1.0 / 5;  // as for dirk

class Exponential final : public OneStep {
 public:
  Exponential(System& system, const SolverSettings& settings, Scratch scratch);
  const char* name() const override { return "exponential (Rosenbrock 4(3))"; }

 private:
  bool begin_step(double h) override;
  bool depends_on_time() const {
    return system_.has_input_slopes() || system_.plan().has_motion() || system_.control();
  }
  double attempt_error(double h) override;
  void set_energy_scale();
  void set_errors_of_work(double h);
  double error_of_work(const double* u) const;
  bool remainder(double c, double h, const double* u, double* to);

  DenseJacobian& jacobian_;
  PhiFunctions phi_;
  std::vector<double> matrix_;                   // J
  std::vector<double> weights_, slope_by_time_;  // at the start of a step; slope_by_time_: df/dt
  std::vector<double> second_, third_;    // D(u2) and D(u3), then the vectors multiplied by phi_3 and phi_4
  std::vector<double> error_, combined_;  // combined_: y + h phi_1 f
  double least_error_of_work_ = 0;        // absolute tolerance of the work in a step, J
  double errors_of_work_[2] = {};         // in an attempt, J
};

[[gnu::cold]] Exponential::Exponential(System& system, const SolverSettings& settings, Scratch scratch)
    : OneStep(system, settings, std::move(scratch), SolverMethod::exponential, 4, tightening),
      jacobian_(scratch_->jacobian()),
      phi_(system.size(), system.layout().work.count),
      matrix_(y_.size() * y_.size()),
      weights_(y_),
      slope_by_time_(y_),
      second_(y_),
      third_(y_),
      error_(y_),
      combined_(y_) {}

// Computes f, J and, if f depends on time, df/dt at the start of a step.
bool Exponential::begin_step(double h) {
  if (system_.with_work()) set_energy_scale();
  if (!slope_known_) {
    ++statistics_.evaluations;
    if (system_.right_hand_side(absolute(reached_), result_, slope_.data()) != Status::ok) return false;
    slope_known_ = true;
  }
  ++statistics_.jacobians;
  ++statistics_.evaluations;
  if (jacobian_.evaluate(absolute(reached_), result_, matrix_.data()) != Status::ok) return false;
  phi_.set_matrix(matrix_.data());
  if (depends_on_time()) {
    const double shift = 1e-3 * h;
    ++statistics_.evaluations;
    if (system_.right_hand_side(absolute(reached_ + shift), result_, slope_by_time_.data()) != Status::ok)
      return false;
    for (std::size_t i = 0; i < slope_.size(); ++i)
      slope_by_time_[i] = (slope_by_time_[i] - slope_[i]) / shift;
  } else {
    std::fill(slope_by_time_.begin(), slope_by_time_.end(), 0.0);
  }
  error_weights_.evaluate(result_, weights_.data());
  return true;
}

// Sets `to` to D(u) at the time c h of the step.
bool Exponential::remainder(double c, double h, const double* u, double* to) {
  ++statistics_.evaluations;
  if (system_.right_hand_side(absolute(reached_ + c * h), u, to) != Status::ok) return false;
  const std::size_t size = y_.size();
  for (std::size_t i = 0; i < size; ++i) to[i] -= slope_[i] + c * h * slope_by_time_[i];
  for (std::size_t j = 0; j < size; ++j)
    subtract(static_cast<std::int64_t>(size), u[j] - result_[j], &matrix_[j * size], to);
  return true;
}

// Leaves the state at the end of a step of size h in candidate_ and returns the error relative to the
// tolerance.
double Exponential::attempt_error(double h) {
  const double infinite = std::numeric_limits<double>::infinity();
  statistics_.other_work += phi_.cost(h);
  if (!phi_.evaluate(h)) return infinite;
  const std::size_t size = y_.size();
  double* u = candidate_;
  std::copy_n(result_, size, u);
  combined_.resize(size);
  std::copy_n(u, size, combined_.begin());
  phi_.add(1, h, slope_.data(), combined_.data(), 0.5 * h, u);
  if (depends_on_time()) phi_.add(2, h * h, slope_by_time_.data(), combined_.data(), 0.25 * h * h, u);
  if (!remainder(0.5, h, u, second_.data())) return infinite;
  std::copy_n(combined_.data(), size, u);
  phi_.add(1, h, second_.data(), u);
  if (!remainder(1, h, u, third_.data())) return infinite;
  set_errors_of_work(h);
  for (std::size_t i = 0; i < size; ++i) {
    const double second = second_[i], third = third_[i];
    second_[i] = 16 * second - 2 * third;
    third_[i] = 12 * third - 48 * second;
  }
  std::fill(error_.begin(), error_.end(), 0.0);
  phi_.add(4, h, third_.data(), error_.data());
  std::copy_n(combined_.data(), size, u);
  phi_.add(3, h, second_.data(), u);
  for (std::size_t i = 0; i < size; ++i) u[i] += error_[i];
  return std::max(error_weights_.norm(error_.data(), weights_.data()), error_of_work(u));
}

// Sets the tolerance of the work. It has the form of that of a velocity v, rtol |v| + atol scale, with the
// kinetic energies of the state and of the nominal velocities.
void Exponential::set_energy_scale() {
  const double time = absolute(reached_);
  const StateLayout& layout = system_.layout();
  system_.nominals(combined_.data());
  std::copy_n(result_, layout.q.count, combined_.begin());
  for (int ball = 0; ball < system_.balls(); ++ball)
    std::copy_n(layout.quaternion.of(result_, ball), 4, layout.quaternion.of(combined_.data(), ball));
  least_error_of_work_ = tightening * settings_.atol * system_.kinetic_energy(time, combined_.data());
  least_error_of_work_ += tightening * settings_.rtol * system_.kinetic_energy(time, result_);
}

// Error of the work, since the power of damped vibrations is not linear and no other state shows the error of
// its integral. The integral of D by Simpson's rule, h (2 D(u2) / 3 + D(u3) / 6), is exact for quadratic D;
// the trapezoidal rule is exact for linear D. The Jacobian has no row for contacts, ports and prescribed
// joints.
void Exponential::set_errors_of_work(double h) {
  const auto& work = system_.layout().work;
  for (int part = 0; part < work.count; ++part) {
    const double second = *work.of(second_.data(), part), third = *work.of(third_.data(), part);
    errors_of_work_[part] = h * std::min(std::abs(2 * second - third / 2), std::abs(2 * second - third) / 3);
  }
}

// Error of the work in a step to `u`, relative to its tolerance.
double Exponential::error_of_work(const double* u) const {
  const auto& work = system_.layout().work;
  double largest = 0;
  for (int part = 0; part < work.count; ++part) {
    const double size = std::max(std::abs(*work.of(u, part)), std::abs(*work.of(result_, part)));
    const double tolerated = least_error_of_work_ + tightening * settings_.rtol * size;
    largest = std::max(largest, errors_of_work_[part] / tolerated);
  }
  return largest;
}

}  // namespace

std::unique_ptr<OneStep> make_exponential(System& system, const SolverSettings& settings, Scratch scratch) {
  return std::make_unique<Exponential>(system, settings, std::move(scratch));
}

}  // namespace redysim
