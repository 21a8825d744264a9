#include "integrate/methods/step_work.hpp"

#include <algorithm>
#include <cmath>

namespace redysim {
namespace {

constexpr double points[StepWork::nodes] = {-0.9324695142031521, -0.6612093864662645, -0.2386191860831969,
                                            0.2386191860831969,  0.6612093864662645,  0.9324695142031521};
constexpr double weights[StepWork::nodes] = {0.1713244923791704, 0.3607615730481386, 0.4679139345726910,
                                             0.4679139345726910, 0.3607615730481386, 0.1713244923791704};

// Legendre polynomials of degree 0 to StepWork::nodes by their recurrence.
void legendre(double x, double* values) {
  values[0] = 1;
  values[1] = x;
  for (int k = 1; k < StepWork::nodes; ++k)
    values[k + 1] = ((2 * k + 1) * x * values[k] - k * values[k - 1]) / (k + 1);
}

}  // namespace

void StepWork::begin(double work) {
  end_ = work;
  offset_ = 0;
  integrated_ = 0;
}

bool StepWork::step(double from, double to, double work, double error, double rtol) {
  begin_ = end_;
  from_ = to_ = from;
  bisections_ = 0;
  step_end_ = to;
  method_end_ = work;
  rtol_ = rtol;
  const double increment = work + offset_ - begin_;
  integrated_ = !(std::fabs(error) <= rtol * (moved_ + std::fabs(increment)));
  if (integrated_ != 0) return true;
  end_ = work + offset_;
  moved_ += std::fabs(increment);
  return false;
}

// The coefficients decrease like a power. The square of the last one, relative to the largest, therefore
// estimates the terms above the exact degree of the quadrature.
bool StepWork::fit(const Power& power) {
  for (double& coefficient : coefficients_) coefficient = 0;
  for (int j = 0; j < nodes; ++j) {
    double value = 0, polynomials[nodes + 1];
    if (!power.function(from_ + 0.5 * (1 + points[j]) * (to_ - from_), power.owner, power.part, value)) {
      coefficients_[0] = NAN;
      return false;
    }
    legendre(points[j], polynomials);
    for (int k = 0; k < nodes; ++k) coefficients_[k] += (k + 0.5) * weights[j] * value * polynomials[k];
  }
  double largest = 0;
  for (double coefficient : coefficients_) largest = std::max(largest, std::fabs(coefficient));
  const double half = 0.5 * (to_ - from_), last = coefficients_[nodes - 1];
  return half * last * last <= largest * (rtol_ * (moved_ + half * std::fabs(integral(1))) + rounding_);
}

// Starts at the end of the present part, with twice its length or at first the whole step, and bisects until
// the power is a polynomial within the tolerance.
void StepWork::next_part(const Power& power) {
  const double length = to_ - from_;
  begin_ = end_;
  from_ = to_;
  to_ = length > 0 ? std::min(from_ + 2 * length, step_end_) : step_end_;
  for (; !fit(power) && bisections_ < most_bisections && from_ + 0.5 * (to_ - from_) > from_; ++bisections_)
    to_ = from_ + 0.5 * (to_ - from_);
  const double increment = 0.5 * (to_ - from_) * integral(1);
  if (std::isfinite(increment)) {
    end_ = begin_ + increment;
    moved_ += std::fabs(increment);
  } else {
    std::fill_n(coefficients_, nodes, 0.0);  // the power cannot be computed from here on
    to_ = step_end_;
  }
}

double StepWork::end(const Power& power) {
  if (integrated_ == 0) return end_;
  while (to_ < step_end_) next_part(power);
  offset_ = end_ - method_end_;
  return end_;
}

// The integral of L_k from -1 to x is (L_k+1 - L_k-1) / (2k + 1).
double StepWork::integral(double x) const {
  double polynomials[nodes + 1];
  legendre(x, polynomials);
  double sum = coefficients_[0] * (1 + x);
  for (int k = 1; k < nodes; ++k)
    sum += coefficients_[k] * (polynomials[k + 1] - polynomials[k - 1]) / (2 * k + 1);
  return sum;
}

double StepWork::at(double time, double work, const Power& power) {
  if (integrated_ == 0) return work + offset_;
  while (to_ < std::min(time, step_end_)) next_part(power);
  if (time == to_) return end_;
  return begin_ + 0.5 * (to_ - from_) * integral(2 * (time - from_) / (to_ - from_) - 1);
}

template <class Self, class Visit>
void StepWork::each_part(Self& self, const Visit& visit) {
  for (auto* value : {&self.from_, &self.to_, &self.step_end_, &self.begin_, &self.end_, &self.method_end_,
                      &self.offset_, &self.moved_, &self.rtol_, &self.rounding_})
    visit(*value);
  visit(self.bisections_);
  visit(self.integrated_);
  for (auto& coefficient : self.coefficients_) visit(coefficient);
}

void StepWork::put(ByteWriter& writer) const {
  each_part(*this, [&writer](const auto& part) { writer.put(part); });
}

void StepWork::get(ByteReader& reader) {
  each_part(*this, [&reader](auto& part) { reader.get(part); });
  bisections_ = std::max(bisections_, 0);
}

}  // namespace redysim
