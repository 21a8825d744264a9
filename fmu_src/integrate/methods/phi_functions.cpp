#include "integrate/methods/phi_functions.hpp"

#include <algorithm>
#include <cmath>

#include "integrate/system/dense_lu.hpp"

namespace redysim {
namespace {

constexpr double largest_argument = 0.5;  // maximum for which the series is accurate to rounding
constexpr int terms = 12;
constexpr int most_doublings = 60;
constexpr double factorials[] = {1, 1, 2, 6, 24};

// Largest power of two that does not exceed a positive value.
double power_of_two(double value) { return std::ldexp(1.0, std::ilogb(value)); }

// Number of doublings, at least one, that reduce a matrix of this norm to the largest argument.
int doublings(double norm) { return norm > largest_argument ? std::ilogb(norm / largest_argument) + 1 : 1; }

void add_identity(int size, double factor, double* matrix) {
  for (int i = 0; i < size; ++i) matrix[i + i * size] += factor;
}

}  // namespace

[[gnu::cold]] PhiFunctions::PhiFunctions(int size, int followers)
    : size_(size), leaders_(size - followers), scale_(static_cast<std::size_t>(size)), vector_(scale_) {
  const std::size_t entries = scale_.size() * scale_.size();
  for (Matrix* matrix : {&balanced_, &scratch_, &half_[1], &half_[2]}) matrix->resize(entries);
  for (Matrix& matrix : phi_) matrix.resize(entries);
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

double PhiFunctions::cost(int size, double norm) {
  return 0.025 * size * size * (terms + highest + (highest + 1) * doublings(norm)) / (highest + 1);
}

bool PhiFunctions::evaluate(double h) {
  if (!std::isfinite(h * norm_)) return false;
  doublings_ = doublings(h * norm_);
  if (doublings_ > most_doublings) return false;
  expand(std::ldexp(h, -doublings_));
  for (int k = 1; k < doublings_; ++k) double_argument();
  half_[1] = phi_[1];
  half_[2] = phi_[2];
  double_argument();
  double sum = 0;
  for (const double entry : phi_[1]) sum += entry;
  return std::isfinite(sum);
}

// phi_4 of `factor` times the matrix by its series, then phi_k = z phi_(k+1) + I / k!.
void PhiFunctions::expand(double factor) {
  Matrix& z = scratch_;
  for (std::size_t k = 0; k < z.size(); ++k) z[k] = factor * balanced_[k];
  Matrix& series = phi_[highest];
  std::fill(series.begin(), series.end(), 0.0);
  double factorial = factorials[highest];
  for (int k = 1; k <= terms; ++k) factorial *= highest + k;
  for (int k = terms; k >= 0; --k) {
    if (k < terms) replace(z, series);
    add_identity(size_, 1 / factorial, series.data());
    factorial /= highest + k;
  }
  for (int k = highest - 1; k >= 0; --k) {
    phi_[k] = phi_[k + 1];
    replace(z, phi_[k]);
    add_identity(size_, 1 / factorials[k], phi_[k].data());
  }
}

void PhiFunctions::replace(Matrix& left, Matrix& right) {
  for (int j = 0; j < size_; ++j) {
    double* to = column(right, j);
    std::copy_n(to, size_, vector_.data());
    std::fill_n(to, size_, 0.0);
    add_product(size_, left.data(), vector_.data(), to);
  }
}

// phi_k(2 z) = 2^-k (e^z phi_k(z) + sum_(j = 1 to k) phi_j(z) / (k - j)!)
void PhiFunctions::double_argument() {
  for (int k = highest; k > 0; --k) {
    scratch_ = phi_[k];
    replace(phi_[0], phi_[k]);
    const double share = std::ldexp(1.0, -k);
    for (std::size_t i = 0; i < scratch_.size(); ++i) {
      double sum = phi_[k][i] + scratch_[i];
      for (int j = 1; j < k; ++j) sum += phi_[j][i] / factorials[k - j];
      phi_[k][i] = share * sum;
    }
  }
  scratch_ = phi_[0];
  replace(scratch_, phi_[0]);
}

void PhiFunctions::add(Matrix& phi, double factor, const double* x, double* y) {
  double* const scaled = vector_.data();
  double* const product = scratch_.data();
  for (int j = 0; j < size_; ++j) scaled[j] = x[j] / scale_[j];
  std::fill_n(product, size_, 0.0);
  add_product(size_, phi.data(), scaled, product);
  for (int i = 0; i < size_; ++i) y[i] += factor * scale_[i] * product[i];
}

}  // namespace redysim
