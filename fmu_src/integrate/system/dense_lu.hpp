#pragma once

#include <cstdint>

// Dense linear algebra for matrices of the size of a state, column-major. SUNDIALS' functions are compiled
// for size.

namespace redysim {

// y -= factor * x, n entries.
void subtract(std::int64_t n, double factor, const double* x, double* y);

// y += matrix x; the matrix is column-major.
void add_product(std::int64_t rows, std::int64_t columns, const double* matrix, const double* x, double* y);

// Replaces an n x n matrix by its factors L (1 on the diagonal) and U, with row interchanges: row k is
// exchanged with row pivots[k], k = 0 to n - 1 in turn. False: it is singular.
bool factor_lu(double* const* columns, std::int64_t n, std::int64_t* pivots);

// Replaces b by the solution, with the matrix as factor_lu left it.
void solve_lu(const double* const* columns, std::int64_t n, const std::int64_t* pivots, double* b);
// The same for `count` right-hand sides, row-major.
void solve_lu(const double* const* columns, std::int64_t n, const std::int64_t* pivots, double* b,
              std::int64_t count);

}  // namespace redysim
