#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "math/row_operations.hpp"

namespace redysim {

// Rows of levers for the choice of independent ones by Gram-Schmidt orthogonalization: values, bounds (their
// maximum absolute values over all configurations) and variances of the errors, each a row-major matrix.
// Bounds are 0 in columns where a row itself has no lever.
// Errors are those of rounding and of a configuration that violates its constraints by `violation`, relative
// to the bounds; they are treated as independent of each other (Higham 2002, 2.8).
class LeverRows {
 public:
  LeverRows(double* values, double* bounds, double* variances, int columns, double squared_violation = 0)
      : values_(values),
        bounds_(bounds),
        variances_(variances),
        columns_(columns),
        squared_error_(unit * unit + squared_violation) {}

  // Divides a row by the length of its bounds. False: no bounds.
  [[gnu::cold, gnu::noinline]] bool normalize(int i) {
    if (!redysim::normalize(row(i), bound(i), columns_)) return false;
    for (int k = 0; k < columns_; ++k) variance(i)[k] = squared_error_ * bound(i)[k] * bound(i)[k];
    return true;
  }

  // Whether the row exceeds this fraction of its bounds, and its error: in a column where it has a lever, or
  // as the lever on the motion along itself, which also moves joints of other rows.
  [[gnu::cold, gnu::noinline]] bool exceeds(int i, double fraction) const {
    double squared = 0, most = 0;
    for (int k = 0; k < columns_; ++k) {
      const double size = std::abs(row(i)[k]), entry_bound = bound(i)[k];
      most += size * entry_bound;
      if (!(size * size > certain * variance(i)[k])) continue;
      if (entry_bound > 0 && size > fraction * entry_bound) return true;
      squared += size * size;
    }
    return squared > fraction * most;
  }

  // Makes a row a unit vector.
  [[gnu::cold, gnu::noinline]] void make_direction(int i) {
    const double length = row_length(row(i), columns_);
    scale_row(row(i), columns_, 1 / length);
    for (int k = 0; k < columns_; ++k) variance(i)[k] /= length * length;
  }

  // Subtracts from row i its component along direction j, unless it is at most `least`, and returns it. Its
  // bounds increase by those that contributed to the row.
  [[gnu::cold, gnu::noinline]] double subtract(int i, int j, double least = 0) {
    double part = 0, error = unit * unit;  // this component and its variance
    for (int k = 0; k < columns_; ++k) part += row(i)[k] * row(j)[k];
    if (std::abs(part) <= least) return 0;  // often: loops without a common joint
    for (int k = 0; k < columns_; ++k) {
      const double of_i = row(i)[k], of_j = row(j)[k];
      error += of_i * of_i * variance(j)[k] + of_j * of_j * variance(i)[k];
    }
    for (int k = 0; k < columns_; ++k) {
      const double along = row(j)[k];
      row(i)[k] -= part * along;
      if (bound(i)[k] > 0) bound(i)[k] += std::abs(part) * std::max(bound(j)[k], std::abs(along));
      variance(i)[k] += part * part * variance(j)[k] + error * along * along;
    }
    return part;
  }

  // Subtracts from direction i what rounding left of its component along direction j.
  void correct(int i, int j) { subtract(i, j, unit); }

 private:
  static constexpr double unit = 1e-15;   // rounding error of an entry relative to its bound
  static constexpr double certain = 1e2;  // squared ratio of a value to its standard deviation

  double* row(int i) const { return values_ + static_cast<std::ptrdiff_t>(i) * columns_; }
  double* bound(int i) const { return bounds_ + static_cast<std::ptrdiff_t>(i) * columns_; }
  double* variance(int i) const { return variances_ + static_cast<std::ptrdiff_t>(i) * columns_; }

  double *values_, *bounds_, *variances_;
  int columns_;
  double squared_error_;  // of an entry relative to its bound
};

}  // namespace redysim
