#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace redysim {

// Least-squares solutions of minimum norm of J x = b for any rank, from the singular value decomposition of J
// (one-sided Jacobi rotations: Golub and Van Loan 2013, 8.6.3). For small matrices at load time: compact, not
// fast.
class LeastNorm {
 public:
  // Singular values up to `relative_tolerance` times the largest, or up to `rounding`, are set to zero.
  LeastNorm(const Eigen::MatrixXd& J, double relative_tolerance, double rounding = 0);

  // Minimises |J x - b|^2 + damping^2 |x|^2.
  Eigen::VectorXd solve(const Eigen::VectorXd& b, double damping = 0) const;

  // The same for J^T: minimises |J^T y - x|^2.
  Eigen::VectorXd solve_transposed(const Eigen::VectorXd& x) const;

  // Orthonormal basis of the left null space, n^T J = 0; one column per vector.
  Eigen::MatrixXd left_null_space() const;

 private:
  static void rotate(Eigen::MatrixXd& matrix, Eigen::Index p, Eigen::Index q, double c, double s);
  bool sweep();
  void move_longest_column_to(Eigen::Index p);
  bool make_orthogonal(Eigen::Index p, Eigen::Index q);

  // J^T V = U, the columns of U orthogonal with the singular values as lengths
  Eigen::MatrixXd U_, V_;
  Eigen::VectorXd squared_;  // singular values squared, zero below the tolerances
};

// Minimises |J x - b|^2 + damping^2 |x|^2 at lower cost, for damping^2 above the rounding errors of J J^T:
// J^T (J J^T + damping^2)^-1 b by Cholesky factorization.
Eigen::VectorXd damped(const Eigen::MatrixXd& J, const Eigen::VectorXd& b, double damping);

// Uses raw pointers because Eigen's expressions are slow in files that are optimised for size.
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
    : U_(J.transpose()), V_(Eigen::MatrixXd::Identity(J.rows(), J.rows())), squared_(J.rows()) {
  constexpr int most_sweeps = 40;
  for (int count = 0; count < most_sweeps && sweep(); ++count) continue;
  double largest = 0;
  for (Eigen::Index k = 0; k < U_.cols(); ++k) {
    double sum = 0;
    for (Eigen::Index i = 0; i < U_.rows(); ++i) sum += U_(i, k) * U_(i, k);
    squared_[k] = sum;
    if (sum > largest) largest = sum;
  }
  const double smallest = std::max(relative_tolerance * std::sqrt(largest), rounding);
  for (double& value : squared_)
    if (value <= smallest * smallest) value = 0;
}

inline Eigen::VectorXd LeastNorm::solve(const Eigen::VectorXd& b, double damping) const {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(U_.rows());
  for (Eigen::Index k = 0; k < U_.cols(); ++k) {
    if (squared_[k] == 0) continue;
    double along = 0;
    for (Eigen::Index i = 0; i < V_.rows(); ++i) along += V_(i, k) * b[i];
    along /= squared_[k] + damping * damping;
    for (Eigen::Index i = 0; i < U_.rows(); ++i) x[i] += along * U_(i, k);
  }
  return x;
}

inline Eigen::VectorXd LeastNorm::solve_transposed(const Eigen::VectorXd& x) const {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(V_.rows());
  for (Eigen::Index k = 0; k < U_.cols(); ++k) {
    if (squared_[k] == 0) continue;
    double along = 0;
    for (Eigen::Index i = 0; i < U_.rows(); ++i) along += U_(i, k) * x[i];
    along /= squared_[k];
    for (Eigen::Index i = 0; i < V_.rows(); ++i) y[i] += along * V_(i, k);
  }
  return y;
}

inline Eigen::VectorXd damped(const Eigen::MatrixXd& J, const Eigen::VectorXd& b, double damping) {
  const Eigen::Index n = J.rows();
  const Eigen::MatrixXd columns = J.transpose();
  Eigen::MatrixXd R(n, n);  // upper, R^T R = J J^T + damping^2
  Eigen::VectorXd x = b;
  const auto dot = [](const double* a, const double* c, Eigen::Index count) {
    double sum = 0;
    for (Eigen::Index k = 0; k < count; ++k) sum += a[k] * c[k];
    return sum;
  };
  for (Eigen::Index j = 0; j < n; ++j) {
    double* of_j = R.data() + j * n;
    for (Eigen::Index i = 0; i <= j; ++i) {
      const double *of_i = R.data() + i * n, *row_i = columns.data() + i * J.cols(),
                   *row_j = columns.data() + j * J.cols();
      const double part = dot(row_i, row_j, J.cols()) - dot(of_i, of_j, i);
      of_j[i] = i < j ? part / of_i[i] : std::sqrt(part + damping * damping);
    }
    x[j] = (x[j] - dot(of_j, x.data(), j)) / of_j[j];
  }
  for (Eigen::Index j = n; j-- > 0;) {
    const double* of_j = R.data() + j * n;
    x[j] /= of_j[j];
    for (Eigen::Index i = 0; i < j; ++i) x[i] -= of_j[i] * x[j];
  }
  return columns.lazyProduct(x);
}

inline Eigen::MatrixXd LeastNorm::left_null_space() const {
  Eigen::Index count = 0;
  for (double value : squared_) count += value == 0 ? 1 : 0;
  Eigen::MatrixXd null(V_.rows(), count);
  for (Eigen::Index k = 0, next = 0; k < V_.cols(); ++k)
    if (squared_[k] == 0) null.col(next++) = V_.col(k);
  return null;
}

}  // namespace redysim
