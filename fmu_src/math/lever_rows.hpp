#pragma once

#include <cmath>
#include <cstddef>

#include "math/row_operations.hpp"

namespace redysim {

// Rows of levers for the choice of independent ones by Gram-Schmidt orthogonalization: values, bounds (their
// maximum absolute values over all configurations) and variances of the errors, each a row-major matrix.
// Errors are those of rounding and of a configuration that violates its constraints by `violation`, relative
// to the bounds; they are treated as independent of each other (Higham 2002, 2.8).
template <class Scalar>
class LeverRows {
 public:
  LeverRows(Scalar* values, Scalar* bounds, double* variances, int columns, double squared_violation = 0)
      : values_(values),
        bounds_(bounds),
        variances_(variances),
        columns_(columns),
        squared_error_(unit * unit + squared_violation) {}

  // Divides a row by the length of its bounds. False: no bounds.
  [[gnu::cold, gnu::noinline]] bool normalize(int i) {
    if (!redysim::normalize(row(i), bound(i), columns_)) return false;
    for (int k = 0; k < columns_; ++k) {
      const double size = value_of(bound(i)[k]);
      variance(i)[k] = squared_error_ * size * size;
    }
    return true;
  }

  // Whether an entry exceeds this fraction of its bound, and its error.
  [[gnu::cold, gnu::noinline]] bool exceeds(int i, double fraction) const {
    for (int k = 0; k < columns_; ++k) {
      const double size = std::abs(value_of(row(i)[k]));
      if (size > fraction * value_of(bound(i)[k]) && size * size > certain * variance(i)[k]) return true;
    }
    return false;
  }

  // Makes a row a unit vector.
  [[gnu::cold, gnu::noinline]] void make_direction(int i) {
    const Scalar length = row_length(row(i), columns_);
    scale_row(row(i), columns_, Scalar(1) / length);
    for (int k = 0; k < columns_; ++k) variance(i)[k] /= value_of(length) * value_of(length);
  }

  // Subtracts from row i its component along direction j, and returns it. Its bounds increase by those that
  // contributed to the row.
  [[gnu::cold, gnu::noinline]] Scalar subtract(int i, int j) {
    Scalar part(0);
    double error = unit * unit;  // variance of this component
    for (int k = 0; k < columns_; ++k) {
      const double of_i = value_of(row(i)[k]), of_j = value_of(row(j)[k]);
      part += row(i)[k] * row(j)[k];
      error += of_i * of_i * variance(j)[k] + of_j * of_j * variance(i)[k];
    }
    if (is_zero(part)) return part;  // often: loops without a common joint
    const double squared = value_of(part) * value_of(part);
    for (int k = 0; k < columns_; ++k) {
      const double along = value_of(row(j)[k]);
      row(i)[k] -= part * row(j)[k];
      bound(i)[k] += std::abs(value_of(part)) * bound(j)[k];
      variance(i)[k] += squared * variance(j)[k] + error * along * along;
    }
    return part;
  }

 private:
  static constexpr double unit = 1e-15;   // rounding error of an entry relative to its bound
  static constexpr double certain = 1e2;  // squared ratio of a value to its standard deviation

  Scalar* row(int i) const { return values_ + static_cast<std::ptrdiff_t>(i) * columns_; }
  Scalar* bound(int i) const { return bounds_ + static_cast<std::ptrdiff_t>(i) * columns_; }
  double* variance(int i) const { return variances_ + static_cast<std::ptrdiff_t>(i) * columns_; }

  Scalar *values_, *bounds_;
  double* variances_;
  int columns_;
  double squared_error_;  // of an entry relative to its bound
};

}  // namespace redysim
