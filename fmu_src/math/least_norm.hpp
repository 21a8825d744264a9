#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace redysim {

// M x and M^T x in loops, because Eigen's products are long and slow in files that are optimised for size.
[[gnu::noinline]] inline Eigen::VectorXd times(const Eigen::MatrixXd& M, const Eigen::VectorXd& x) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(M.rows());
  const double* of_k = M.data();
  for (Eigen::Index k = 0; k < M.cols(); ++k, of_k += M.rows())
    for (Eigen::Index i = 0; i < M.rows(); ++i) sum[i] += x[k] * of_k[i];
  return sum;
}
[[gnu::noinline]] inline Eigen::VectorXd transposed_times(const Eigen::MatrixXd& M,
                                                          const Eigen::VectorXd& x) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(M.cols());
  const double* of_k = M.data();
  for (Eigen::Index k = 0; k < M.cols(); ++k, of_k += M.rows())
    for (Eigen::Index i = 0; i < M.rows(); ++i) sum[k] += of_k[i] * x[i];
  return sum;
}

// Cholesky factor of J J^T + damping^2: R^T R. Entries above the first nonzero one of each column of R remain
// zero, so that rows of J with few entries and few neighbours cost little.
class RowFactor {
 public:
  static constexpr double independent = 1e-5;  // `relative`, for clearly independent rows

  // Stops where the square of a pivot is at most `smallest`, or `relative` times the maximum of the diagonal.
  RowFactor(const Eigen::MatrixXd& J, double damping, double relative = 0, double smallest = 0);
  bool is_complete() const { return complete_; }

  Eigen::VectorXd solve(Eigen::VectorXd b) const;  // (J J^T + damping^2) x = b

 private:
  void factor(double smallest);

  Eigen::MatrixXd R_;
  std::vector<Eigen::Index> first_;  // first nonzero entry of each column
  bool complete_ = true;
};

// Least-squares solutions of minimum norm of J x = b for any rank. Rows that are clearly independent: from
// RowFactor, with one refinement. Otherwise from the singular value decomposition of J (one-sided Jacobi
// rotations: Golub and Van Loan 2013, 8.6.3). For load time: compact, not fast.
class LeastNorm {
 public:
  // Singular values up to `relative_tolerance` times the largest, or up to `rounding`, are set to zero.
  LeastNorm(const Eigen::MatrixXd& J, double relative_tolerance, double rounding = 0);

  // Minimises |J x - b|^2 + damping^2 |x|^2. Ignores the damping where the rows are clearly independent.
  Eigen::VectorXd solve(const Eigen::VectorXd& b, double damping = 0) const;

  // The same for J^T: minimises |J^T y - x|^2.
  Eigen::VectorXd solve_transposed(const Eigen::VectorXd& x) const;

  // Orthonormal basis of the left null space, n^T J = 0; one column per vector.
  Eigen::MatrixXd left_null_space() const;

 private:
  void decompose(double relative_tolerance, double rounding);
  Eigen::VectorXd over_squares(Eigen::VectorXd along, double damping) const;
  static void rotate(Eigen::MatrixXd& matrix, Eigen::Index p, Eigen::Index q, double c, double s);
  bool sweep();
  void move_longest_column_to(Eigen::Index p);
  bool make_orthogonal(Eigen::Index p, Eigen::Index q);

  RowFactor rows_;
  // J^T V = U, the columns of U orthogonal with the singular values as lengths; with rows_ complete, U = J^T
  // and V is empty
  Eigen::MatrixXd U_, V_;
  Eigen::VectorXd squared_;  // singular values squared, zero below the tolerances
};

// Minimises |J x - b|^2 + damping^2 |x|^2 at lower cost, for damping^2 above the rounding errors of J J^T.
inline Eigen::VectorXd damped(const Eigen::MatrixXd& J, const Eigen::VectorXd& b, double damping) {
  return transposed_times(J, RowFactor(J, damping).solve(b));
}

inline RowFactor::RowFactor(const Eigen::MatrixXd& J, double damping, double relative, double smallest)
    : R_(Eigen::MatrixXd::Zero(J.rows(), J.rows())), first_(static_cast<std::size_t>(J.rows())) {
  double largest = 0;
  for (Eigen::Index j = 0; j < R_.cols(); ++j) {
    double* of_j = R_.data() + j * R_.rows();
    for (Eigen::Index k = 0; k < J.cols(); ++k) {
      const double *column = J.data() + k * J.rows(), factor = column[j];
      for (Eigen::Index i = 0; factor != 0 && i <= j; ++i) of_j[i] += factor * column[i];
    }
    largest = std::max(largest, of_j[j]);
    of_j[j] += damping * damping;
  }
  factor(std::max(relative * largest, smallest));
}

inline void RowFactor::factor(double smallest) {
  for (Eigen::Index j = 0; j < R_.cols(); ++j) {
    double* of_j = R_.data() + j * R_.rows();
    Eigen::Index& first = first_[static_cast<std::size_t>(j)];
    while (first < j && of_j[first] == 0) ++first;
    for (Eigen::Index i = first; i <= j; ++i) {
      const double* of_i = R_.data() + i * R_.rows();
      double part = of_j[i];
      for (Eigen::Index k = std::max(first, first_[static_cast<std::size_t>(i)]); k < i; ++k)
        part -= of_i[k] * of_j[k];
      if (i == j && !(part > smallest)) {
        complete_ = false;
        return;
      }
      of_j[i] = i < j ? part / of_i[i] : std::sqrt(part);
    }
  }
}

inline Eigen::VectorXd RowFactor::solve(Eigen::VectorXd b) const {
  for (Eigen::Index j = 0; j < b.size(); ++j) {
    const double* of_j = R_.data() + j * R_.rows();
    for (Eigen::Index i = first_[static_cast<std::size_t>(j)]; i < j; ++i) b[j] -= of_j[i] * b[i];
    b[j] /= of_j[j];
  }
  for (Eigen::Index j = b.size(); j-- > 0;) {
    const double* of_j = R_.data() + j * R_.rows();
    b[j] /= of_j[j];
    for (Eigen::Index i = first_[static_cast<std::size_t>(j)]; i < j; ++i) b[i] -= of_j[i] * b[j];
  }
  return b;
}

inline void LeastNorm::rotate(Eigen::MatrixXd& matrix, Eigen::Index p, Eigen::Index q, double c, double s) {
  double *left = matrix.data() + p * matrix.rows(), *right = matrix.data() + q * matrix.rows();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    const double l = left[i], r = right[i];
    left[i] = c * l - s * r;
    right[i] = s * l + c * r;
  }
}

// Fewer sweeps are needed if each column in turn is the longest of the remaining ones (de Rijk 1989).
inline void LeastNorm::move_longest_column_to(Eigen::Index p) {
  Eigen::Index longest = p;
  for (Eigen::Index q = p + 1; q < U_.cols(); ++q)
    if (U_.col(q).squaredNorm() > U_.col(longest).squaredNorm()) longest = q;
  if (longest == p) return;
  rotate(U_, p, longest, 0, 1);
  rotate(V_, p, longest, 0, 1);
}

// Jacobi rotation that makes columns p and q orthogonal; false if they already are.
inline bool LeastNorm::make_orthogonal(Eigen::Index p, Eigen::Index q) {
  constexpr double orthogonal = 1e-15;
  const double *left = U_.data() + p * U_.rows(), *right = U_.data() + q * U_.rows();
  double pp = 0, qq = 0, pq = 0;
  for (Eigen::Index i = 0; i < U_.rows(); ++i) {
    pp += left[i] * left[i];
    qq += right[i] * right[i];
    pq += left[i] * right[i];
  }
  if (!(std::abs(pq) > orthogonal * std::sqrt(pp * qq)) || std::abs(pq) < 1e-300) return false;
  const double zeta = (qq - pp) / (2 * pq);
  const double t = (zeta < 0 ? -1 : 1) / (std::abs(zeta) + std::hypot(1.0, zeta));
  const double c = 1 / std::hypot(1.0, t), s = c * t;
  rotate(U_, p, q, c, s);
  rotate(V_, p, q, c, s);
  return true;
}

// One sweep over all pairs of columns; false if all were already orthogonal.
inline bool LeastNorm::sweep() {
  bool rotated = false;
  for (Eigen::Index p = 0; p < U_.cols(); ++p) {
    move_longest_column_to(p);
    for (Eigen::Index q = p + 1; q < U_.cols(); ++q) rotated = make_orthogonal(p, q) || rotated;
  }
  return rotated;
}

inline LeastNorm::LeastNorm(const Eigen::MatrixXd& J, double relative_tolerance, double rounding)
    : rows_(J, 0, RowFactor::independent, 1e4 * rounding * rounding), U_(J.transpose()) {
  if (!rows_.is_complete()) decompose(relative_tolerance, rounding);
}

inline void LeastNorm::decompose(double relative_tolerance, double rounding) {
  V_.setIdentity(U_.cols(), U_.cols());
  squared_.resize(U_.cols());
  constexpr int most_sweeps = 40;
  for (int count = 0; count < most_sweeps && sweep(); ++count) continue;
  double largest = 0;
  for (Eigen::Index k = 0; k < U_.cols(); ++k) {
    squared_[k] = U_.col(k).squaredNorm();
    largest = std::max(largest, squared_[k]);
  }
  const double smallest = std::max(relative_tolerance * std::sqrt(largest), rounding);
  for (double& value : squared_)
    if (value <= smallest * smallest) value = 0;
}

inline Eigen::VectorXd LeastNorm::solve(const Eigen::VectorXd& b, double damping) const {
  if (!rows_.is_complete()) return times(U_, over_squares(transposed_times(V_, b), damping));
  const Eigen::VectorXd x = times(U_, rows_.solve(b));
  return x + times(U_, rows_.solve(b - transposed_times(U_, x)));
}

inline Eigen::VectorXd LeastNorm::solve_transposed(const Eigen::VectorXd& x) const {
  if (!rows_.is_complete()) return times(V_, over_squares(transposed_times(U_, x), 0));
  const Eigen::VectorXd y = rows_.solve(transposed_times(U_, x));
  return y + rows_.solve(transposed_times(U_, x - times(U_, y)));
}

inline Eigen::VectorXd LeastNorm::over_squares(Eigen::VectorXd along, double damping) const {
  for (Eigen::Index k = 0; k < along.size(); ++k)
    along[k] = squared_[k] == 0 ? 0 : along[k] / (squared_[k] + damping * damping);
  return along;
}

inline Eigen::MatrixXd LeastNorm::left_null_space() const {
  Eigen::Index count = 0;
  for (double value : squared_) count += value == 0 ? 1 : 0;
  Eigen::MatrixXd null(U_.cols(), count);
  for (Eigen::Index k = 0, next = 0; k < V_.cols(); ++k)
    if (squared_[k] == 0) null.col(next++) = V_.col(k);
  return null;
}

}  // namespace redysim
