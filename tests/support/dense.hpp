#pragma once

#include <Eigen/Core>

// Dense linear algebra for comparisons, compiled once.

namespace redysim::test {

// Solution of A X = B. A: regular.
Eigen::MatrixXd solve(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
// A: symmetric and positive definite.
Eigen::MatrixXd solve_definite(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

// Of a symmetric matrix, in increasing order.
Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& A);

// Pivots below `threshold` times the largest one are 0.
struct PseudoInverse {
  Eigen::MatrixXd matrix;
  Eigen::Index rank;
};
PseudoInverse pseudo_inverse(const Eigen::MatrixXd& A, double threshold = 1e-10);

}  // namespace redysim::test
