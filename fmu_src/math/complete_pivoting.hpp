#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

namespace redysim {

// LU factorization P J Q = L U with complete pivoting (Golub and Van Loan 2013, 3.4.8). Selects the columns
// of J that determine the others. For small matrices.
class CompletePivoting {
 public:
  // Pivots are taken in the first `eligible` columns only. Stops after `most` pivots, or when no remaining
  // entry there is larger than `smallest` in absolute value.
  CompletePivoting(Eigen::MatrixXd J, Eigen::Index most, double smallest, Eigen::Index eligible)
      : LU_(std::move(J)), rows_(in_order(LU_.rows())), columns_(in_order(LU_.cols())), eligible_(eligible) {
    while (rank_ < std::min({most, LU_.rows(), eligible_}) && take_largest(smallest)) ++rank_;
  }

  Eigen::Index rank() const { return rank_; }
  // Column numbers of J: the pivot columns, then the others.
  const std::vector<int>& columns() const { return columns_; }

  // x that satisfies the pivot rows of J x = b; nonzero only in the pivot columns. Size of b: rows of J.
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const {
    Eigen::VectorXd z(rank_), x = Eigen::VectorXd::Zero(LU_.cols());
    for (Eigen::Index i = 0; i < rank_; ++i) {
      z[i] = b[rows_[i]];
      for (Eigen::Index k = 0; k < i; ++k) z[i] -= LU_(i, k) * z[k];
    }
    solve_upper(z.data());
    for (Eigen::Index i = 0; i < rank_; ++i) x[columns_[i]] = z[i];
    return x;
  }

  // Whether the determinant of J is negative. J is square and of full rank.
  bool is_negative() const {
    bool negative = odd_;
    for (Eigen::Index i = 0; i < rank_; ++i) negative ^= LU_(i, i) < 0;
    return negative;
  }

  // Maximum absolute entry of x in the pivot columns, over all x with J x = 0 that are a unit vector in the
  // other columns. May be called only once because it overwrites the other columns.
  double leverage() {
    double largest = 0;
    for (Eigen::Index j = rank_; j < LU_.cols(); ++j) {
      double* column = LU_.data() + j * LU_.rows();
      solve_upper(column);
      for (Eigen::Index i = 0; i < rank_; ++i) largest = std::max(largest, std::abs(column[i]));
    }
    return largest;
  }

 private:
  static std::vector<int> in_order(Eigen::Index count) {
    std::vector<int> numbers(static_cast<std::size_t>(count));
    std::iota(numbers.begin(), numbers.end(), 0);
    return numbers;
  }

  void solve_upper(double* z) const {
    for (Eigen::Index i = rank_; i-- > 0;) {
      for (Eigen::Index k = i + 1; k < rank_; ++k) z[i] -= LU_(i, k) * z[k];
      z[i] /= LU_(i, i);
    }
  }

  bool take_largest(double smallest) {
    const Eigen::Index n = rank_;
    Eigen::Index row = n, column = n;
    for (Eigen::Index j = n; j < eligible_; ++j)
      for (Eigen::Index i = n; i < LU_.rows(); ++i)
        if (std::abs(LU_(i, j)) > std::abs(LU_(row, column))) row = i, column = j;
    if (!(std::abs(LU_(row, column)) > smallest)) return false;
    for (Eigen::Index j = 0; j < LU_.cols(); ++j) std::swap(LU_(n, j), LU_(row, j));
    for (Eigen::Index i = 0; i < LU_.rows(); ++i) std::swap(LU_(i, n), LU_(i, column));
    odd_ ^= (row != n) ^ (column != n);
    std::swap(rows_[n], rows_[row]);
    std::swap(columns_[n], columns_[column]);
    for (Eigen::Index i = n + 1; i < LU_.rows(); ++i) LU_(i, n) /= LU_(n, n);
    for (Eigen::Index j = n + 1; j < LU_.cols(); ++j)
      for (Eigen::Index i = n + 1; i < LU_.rows(); ++i) LU_(i, j) -= LU_(i, n) * LU_(n, j);
    return true;
  }

  Eigen::MatrixXd LU_;
  std::vector<int> rows_, columns_;
  Eigen::Index rank_ = 0, eligible_;
  bool odd_ = false;  // the permutations of rows and columns together
};

}  // namespace redysim
