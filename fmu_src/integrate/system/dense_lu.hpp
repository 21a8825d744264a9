#pragma once

#include <cstdint>

// Dense systems of the size of a state, by columns. SUNDIALS has the same, compiled for size.

namespace redysim {

// y -= factor * x, n entries.
void subtract(std::int64_t n, double factor, const double* x, double* y);

// y += matrix x, the matrix of n rows by columns.
void add_product(std::int64_t n, const double* matrix, const double* x, double* y);

// Overwrites a matrix of n columns by its factors L (1 on the diagonal) and U, with row interchanges:
// `pivots` are the rows that are exchanged with rows 0 to n - 1, in turn. False: it is singular.
bool factor_lu(double* const* columns, std::int64_t n, std::int64_t* pivots);

// b -> x, with the matrix as factor_lu left it.
void solve_lu(const double* const* columns, std::int64_t n, const std::int64_t* pivots, double* b);
// The same for `count` of them, by rows.
void solve_lu(const double* const* columns, std::int64_t n, const std::int64_t* pivots, double* b,
              std::int64_t count);

}  // namespace redysim
