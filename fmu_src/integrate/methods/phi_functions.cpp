#include "integrate/methods/phi_functions.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "integrate/methods/tuning.hpp"
#include "integrate/system/dense_lu.hpp"

namespace redysim {
namespace {

constexpr double largest_argument = 0.5;  // maximum for which the series is accurate to rounding
constexpr int terms = 13;                 // of the series of phi_k
constexpr int few = 3;     // leaders, for which calls of add_product take longer than the products
constexpr int blocks = 5;  // of three terms of the exponential series

// [k]: 1 / k!
struct InverseFactorials {
  double of[20] = {1};
  constexpr InverseFactorials() {
    double factorial = 1;
    for (int k = 1; k < 20; ++k) of[k] = 1 / (factorial *= k);
  }
};
constexpr InverseFactorials inverse_factorial;

// Largest power of two that does not exceed a positive value.
double power_of_two(double value) { return std::ldexp(1.0, std::ilogb(value)); }

// Number of doublings, at least one, that reduce a matrix of this norm to the largest argument.
int doublings(double norm) { return norm > largest_argument ? std::ilogb(norm / largest_argument) + 1 : 1; }

}  // namespace

[[gnu::cold]] PhiFunctions::PhiFunctions(int size, int followers)
    : size_(size),
      leaders_(size - followers),
      scale_(static_cast<std::size_t>(size)),
      balanced_(scale_.size() * scale_.size()),
      z_(balanced_),
      square_(balanced_),
      cube_(balanced_),
      product_(scale_) {
  for (auto& vector : of_) vector = scale_;
  if (size <= Tuning::implicit_from_start)
    for (int i = 0; i < most_doublings; ++i) exponential(i);
}

double* PhiFunctions::exponential(int i) {
  if (!exponentials_[i]) exponentials_[i].reset(new double[z_.size()]);
  return exponentials_[i].get();
}

// Scales the variables by powers of two until the norms of row and column of each variable are equal within a
// factor of 4 (Parlett, Reinsch 1969). For a vibration of w rad/s they are 1 and w^2 before, and w after. The
// row of a follower gets the norm 1.
void PhiFunctions::set_matrix(const double* a) {
  std::copy_n(a, balanced_.size(), balanced_.begin());
  std::fill(scale_.begin(), scale_.end(), 1.0);
  bool changed = true;
  for (int sweep = 0; changed && sweep < 100; ++sweep) {
    changed = false;
    for (int i = 0; i < leaders_; ++i) {
      double of_column = -std::abs(column(balanced_, i)[i]);
      for (int j = 0; j < leaders_; ++j) of_column += std::abs(column(balanced_, i)[j]);
      const double ratio = std::sqrt(norm_of_row(i) / of_column);
      if (!(ratio > 0) || !std::isfinite(ratio) || (ratio > 0.5 && ratio < 2)) continue;
      rescale(i, power_of_two(ratio));
      changed = true;
    }
  }
  norm_ = 0;
  for (int j = 0; j < leaders_; ++j) {
    double sum = 0;
    for (int i = 0; i < leaders_; ++i) sum += std::abs(column(balanced_, j)[i]);
    norm_ = std::max(norm_, sum);
  }
  for (int i = leaders_; i < size_; ++i)
    if (const double norm = norm_of_row(i); norm > 0) rescale(i, power_of_two(norm));
}

double PhiFunctions::norm_of_row(int i) {
  double sum = 0;
  for (int j = 0; j < leaders_; ++j)
    if (j != i) sum += std::abs(column(balanced_, j)[i]);
  return sum;
}

void PhiFunctions::rescale(int variable, double factor) {
  scale_[variable] *= factor;
  for (int j = 0; j < size_; ++j) {
    column(balanced_, j)[variable] /= factor;
    column(balanced_, variable)[j] *= factor;
  }
}

// One product of matrix and vector takes as long as 0.005 size + 0.85 / size right-hand sides.
double PhiFunctions::cost(int size, double norm) {
  const int squarings = doublings(norm);
  const double products = blocks + squarings, vectors = 4 * terms + 9 * (1 + squarings);
  return (size * products + vectors) * (0.005 * size + 0.85 / size);
}

bool PhiFunctions::evaluate(double h) {
  if (!std::isfinite(h * norm_)) return false;
  doublings_ = doublings(h * norm_);
  if (doublings_ > most_doublings) return false;
  const double share = std::ldexp(h, -doublings_);
  for (std::size_t i = 0; i < z_.size(); ++i) z_[i] = share * balanced_[i];
  expand();
  for (int i = 1; i < doublings_; ++i) set_product(exponential(i - 1), exponential(i - 1), exponential(i));
  const double* const last = exponential(doublings_ - 1);
  return std::isfinite(std::accumulate(last, last + z_.size(), 0.0));
}

// e^z by its series, as a polynomial in z^3 whose coefficients are polynomials in z (Paterson, Stockmeyer,
// SIAM J. Comput. 2, 1973).
void PhiFunctions::expand() {
  double* const sum = exponential(0);
  set_product(z_.data(), z_.data(), square_.data());
  set_product(z_.data(), square_.data(), cube_.data());
  std::fill_n(sum, z_.size(), 0.0);
  for (int first = 3 * (blocks - 1); first >= 0; first -= 3) {
    if (first < 3 * (blocks - 1)) set_product(cube_.data(), sum, sum);
    const double second = inverse_factorial.of[first + 1], third = inverse_factorial.of[first + 2];
    for (std::size_t i = 0; i < z_.size(); ++i) sum[i] += second * z_[i] + third * square_[i];
    for (int i = 0; i < size_; ++i) sum[i + i * size_] += inverse_factorial.of[first];
  }
}

// Followers, whose columns are those of a multiple of the identity, are added last.
void PhiFunctions::multiply(const double* left, const double* x, double* y) const {
  std::fill_n(y, size_, 0.0);
  if (leaders_ <= few) {  // the call would take longer
    for (int j = 0; j < size_; ++j, left += size_)
      for (int i = 0; i < size_; ++i) y[i] += left[i] * x[j];
    return;
  }
  add_product(size_, leaders_, left, x, y);
  add_product(size_, size_ - leaders_, left + leaders_ * size_, x + leaders_, y);
}

void PhiFunctions::set_product(const double* left, const double* right, double* to) {
  for (int j = 0; j < size_; ++j, right += size_, to += size_) {
    multiply(left, right, product_.data());
    std::copy_n(product_.data(), size_, to);
  }
}

// Sets of_[1] to of_[k] to phi_1(z) x to phi_k(z) x, x = of_[0]: the last by its series, then phi_j = z
// phi_(j+1) + I / j!.
void PhiFunctions::start_vectors(int k) {
  const double* const x = of_[0].data();
  double* const series = of_[k].data();
  std::fill_n(series, size_, 0.0);
  for (int term = terms; term >= 0; --term) {
    multiply(z_.data(), series, product_.data());
    const double share = inverse_factorial.of[k + term];
    for (int i = 0; i < size_; ++i) series[i] = product_[i] + share * x[i];
  }
  for (int j = k - 1; j > 0; --j) {
    multiply(z_.data(), of_[j + 1].data(), of_[j].data());
    const double share = inverse_factorial.of[j];
    for (int i = 0; i < size_; ++i) of_[j][i] += share * x[i];
  }
}

// phi_k(2 z) = 2^-k (e^z phi_k(z) + sum_(j = 1 to k) phi_j(z) / (k - j)!)
void PhiFunctions::double_argument(const double* exponential, int k) {
  for (; k > 0; --k) {
    multiply(exponential, of_[k].data(), product_.data());
    double* const to = of_[k].data();
    for (int i = 0; i < size_; ++i) to[i] += product_[i];
    for (int j = 1; j < k; ++j) subtract(size_, -inverse_factorial.of[k - j], of_[j].data(), to);
    const double share = std::ldexp(1.0, -k);
    for (int i = 0; i < size_; ++i) to[i] *= share;
  }
}

void PhiFunctions::add_to(double* y, int k, double factor) const {
  for (int i = 0; i < size_; ++i) y[i] += factor * scale_[i] * of_[k][i];
}

void PhiFunctions::add(int k, double factor, const double* x, double* y, double half_factor,
                       double* at_half) {
  for (int i = 0; i < size_; ++i) of_[0][i] = x[i] / scale_[i];
  start_vectors(k);
  for (int level = 0; level < doublings_; ++level) {
    if (at_half && level == doublings_ - 1) add_to(at_half, k, half_factor);
    double_argument(exponential(level), k);
  }
  add_to(y, k, factor);
}

}  // namespace redysim
