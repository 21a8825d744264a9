#pragma once

#include <Eigen/Core>
#include <cmath>

namespace redysim {

// Least-squares, least-norm solutions of J x = b for any rank, by the singular values of J (one-sided Jacobi
// rotations: Golub and Van Loan 2013, 8.6.3). For small matrices at load time: short code, no speed.
class LeastNorm {
 public:
  // Singular values below `rank_tolerance` times the largest count as zero.
  LeastNorm(const Eigen::MatrixXd& J, double rank_tolerance);

  // Minimises |J x - b|^2 + damping^2 |x|^2.
  Eigen::VectorXd solve(const Eigen::VectorXd& b, double damping = 0) const;

  // Combinations n of rows that vanish, n^T J = 0: orthonormal columns.
  Eigen::MatrixXd left_null_space() const;

 private:
  // J^T V = U with columns of U orthogonal, their lengths the singular values
  Eigen::MatrixXd U_, V_;
  Eigen::VectorXd squared_;  // singular values squared; 0: dependent
};

inline LeastNorm::LeastNorm(const Eigen::MatrixXd& J, double rank_tolerance)
    : U_(J.transpose()), V_(Eigen::MatrixXd::Identity(J.rows(), J.rows())), squared_(J.rows()) {
  constexpr double orthogonal = 1e-15;
  constexpr int sweeps = 40;
  bool rotated = true;
  for (int sweep = 0; sweep < sweeps && rotated; ++sweep) {
    rotated = false;
    for (Eigen::Index p = 0; p < U_.cols(); ++p)
      for (Eigen::Index q = p + 1; q < U_.cols(); ++q) {
        double pp = 0, qq = 0, pq = 0;
        for (Eigen::Index i = 0; i < U_.rows(); ++i) {
          pp += U_(i, p) * U_(i, p);
          qq += U_(i, q) * U_(i, q);
          pq += U_(i, p) * U_(i, q);
        }
        if (!(std::abs(pq) > orthogonal * std::sqrt(pp * qq)) || std::abs(pq) < 1e-300) continue;
        rotated = true;
        const double zeta = (qq - pp) / (2 * pq);
        const double t = (zeta < 0 ? -1 : 1) / (std::abs(zeta) + std::hypot(1.0, zeta));
        const double c = 1 / std::hypot(1.0, t), s = c * t;
        for (Eigen::MatrixXd* matrix : {&U_, &V_})
          for (Eigen::Index i = 0; i < matrix->rows(); ++i) {
            const double left = (*matrix)(i, p), right = (*matrix)(i, q);
            (*matrix)(i, p) = c * left - s * right;
            (*matrix)(i, q) = s * left + c * right;
          }
      }
  }
  double largest = 0;
  for (Eigen::Index k = 0; k < U_.cols(); ++k) {
    double sum = 0;
    for (Eigen::Index i = 0; i < U_.rows(); ++i) sum += U_(i, k) * U_(i, k);
    squared_[k] = sum;
    if (sum > largest) largest = sum;
  }
  for (double& value : squared_)
    if (value <= rank_tolerance * rank_tolerance * largest) value = 0;
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

inline Eigen::MatrixXd LeastNorm::left_null_space() const {
  Eigen::Index count = 0;
  for (double value : squared_) count += value == 0 ? 1 : 0;
  Eigen::MatrixXd null(V_.rows(), count);
  for (Eigen::Index k = 0, next = 0; k < V_.cols(); ++k)
    if (squared_[k] == 0) null.col(next++) = V_.col(k);
  return null;
}

}  // namespace redysim
