#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "math/dual.hpp"

// Rows of a row-major matrix, `columns` numbers each.

namespace redysim {

// Subtracts from row i its components along rows first..i - 1 that are not skipped, twice for accuracy. Calls
// note(j, component) for each component.
template <class Scalar, class Note>
void orthogonalize(Scalar* rows, int columns, int i, int first, const std::vector<char>& skipped, Note note) {
  Scalar* row = rows + static_cast<std::ptrdiff_t>(i) * columns;
  for (int repeat = 0; repeat < 2; ++repeat)
    for (int j = first; j < i; ++j) {
      if (skipped[j]) continue;
      const Scalar* other = rows + static_cast<std::ptrdiff_t>(j) * columns;
      Scalar part(0);
      for (int k = 0; k < columns; ++k) part += row[k] * other[k];
      if (is_zero(part)) continue;  // often: loops without a common joint
      for (int k = 0; k < columns; ++k) row[k] -= part * other[k];
      note(j, part);
    }
}

template <class Scalar>
Scalar row_length(const Scalar* row, int columns) {
  using std::sqrt;
  Scalar sum(0);
  for (int k = 0; k < columns; ++k) sum += row[k] * row[k];
  return sqrt(sum);
}

template <class Scalar>
void scale_row(Scalar* row, int columns, const Scalar& factor) {
  for (int k = 0; k < columns; ++k) row[k] *= factor;
}

// Divides a row and its bounds by the length of the bounds: its entries are at most one. False: no bounds.
template <class Scalar>
bool normalize(Scalar* row, Scalar* bound, int columns) {
  const Scalar length = row_length(bound, columns);
  if (!(length > Scalar(0))) return false;
  scale_row(row, columns, Scalar(1) / length);
  scale_row(bound, columns, Scalar(1) / length);
  return true;
}

// Subtracts from a row its component along another one.
template <class Scalar>
void subtract_component(Scalar* row, const Scalar* along, const Scalar& squared_length, int columns) {
  Scalar part(0);
  for (int k = 0; k < columns; ++k) part += row[k] * along[k];
  if (is_zero(part)) return;
  part /= squared_length;
  for (int k = 0; k < columns; ++k) row[k] -= part * along[k];
}

}  // namespace redysim
