#include "integrate/system/dense_lu.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace redysim {

void subtract(std::int64_t n, double factor, const double* __restrict x, double* __restrict y) {
  for (std::int64_t i = 0; i < n; ++i) y[i] -= factor * x[i];
}

void add_product(std::int64_t rows, std::int64_t columns, const double* __restrict matrix, const double* x,
                 double* __restrict y) {
  std::int64_t k = 0;
  for (; k + 4 <= columns; k += 4, matrix += 4 * rows)
    for (std::int64_t i = 0; i < rows; ++i)
      y[i] += matrix[i] * x[k] + matrix[i + rows] * x[k + 1] + matrix[i + 2 * rows] * x[k + 2] +
              matrix[i + 3 * rows] * x[k + 3];
  for (; k < columns; ++k, matrix += rows) subtract(rows, -x[k], matrix, y);
}

bool factor_lu(double* const* columns, std::int64_t n, std::int64_t* pivots) {
  for (std::int64_t k = 0; k < n; ++k) {
    double* const column = columns[k];
    std::int64_t largest = k;
    for (std::int64_t i = k + 1; i < n; ++i)
      if (std::abs(column[i]) > std::abs(column[largest])) largest = i;
    pivots[k] = largest;
    if (column[largest] == 0) return false;
    if (largest != k)
      for (std::int64_t j = 0; j < n; ++j) std::swap(columns[j][k], columns[j][largest]);
    const double inverse = 1 / column[k];
    for (std::int64_t i = k + 1; i < n; ++i) column[i] *= inverse;
    for (std::int64_t j = k + 1; j < n; ++j)
      if (columns[j][k] != 0) subtract(n - k - 1, columns[j][k], column + k + 1, columns[j] + k + 1);
  }
  return true;
}

void solve_lu(const double* const* columns, std::int64_t n, const std::int64_t* pivots, double* b) {
  for (std::int64_t k = 0; k < n; ++k) std::swap(b[k], b[pivots[k]]);
  for (std::int64_t k = 0; k < n; ++k) subtract(n - k - 1, b[k], columns[k] + k + 1, b + k + 1);
  for (std::int64_t k = n; k-- > 0;) {
    b[k] /= columns[k][k];
    subtract(k, b[k], columns[k], b);
  }
}

void solve_lu(const double* const* columns, std::int64_t n, const std::int64_t* pivots, double* b,
              std::int64_t count) {
  const auto row = [=](std::int64_t k) { return b + k * count; };
  for (std::int64_t k = 0; k < n; ++k)
    if (pivots[k] != k) std::swap_ranges(row(k), row(k) + count, row(pivots[k]));
  for (std::int64_t k = 0; k < n; ++k)
    for (std::int64_t i = k + 1; i < n; ++i) subtract(count, columns[k][i], row(k), row(i));
  for (std::int64_t k = n; k-- > 0;) {
    for (std::int64_t c = 0; c < count; ++c) row(k)[c] /= columns[k][k];
    for (std::int64_t i = 0; i < k; ++i) subtract(count, columns[k][i], row(k), row(i));
  }
}

}  // namespace redysim
