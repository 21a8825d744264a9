#pragma once

#include <vector>

namespace redysim {

// The functions phi_k(z) = sum_j z^j / (j + k)! of a matrix h A, k = 1 to 4, by scaling and squaring of a
// balanced matrix (Skaflestad, Wright, Appl. Numer. Math. 59, 2009).
class PhiFunctions {
 public:
  // The last `followers` variables do not influence the others, not even by rounding.
  PhiFunctions(int size, int followers);

  void set_matrix(const double* a);  // A, column-major
  bool evaluate(double h);           // false: the result is not finite

  // y += factor phi_k(h A) x; add_half uses phi_k(h A / 2), k = 1 or 2.
  void add(int k, double factor, const double* x, double* y) { add(phi_[k], factor, x, y); }
  void add_half(int k, double factor, const double* x, double* y) { add(half_[k], factor, x, y); }

  // CPU time of evaluate(h), in right-hand sides of an open tree of this size. `norm`: norm of h A.
  static double cost(int size, double norm);
  double cost(double h) const { return cost(size_, h * norm_); }

 private:
  using Matrix = std::vector<double>;  // column-major
  static constexpr int highest = 4;

  double* column(Matrix& matrix, int j) const { return &matrix[static_cast<std::size_t>(j) * scale_.size()]; }
  void rescale(int variable, double factor);
  double norm_of_row(int i);
  void expand(double factor);
  void replace(Matrix& left, Matrix& right);  // right = left right
  void double_argument();
  void add(Matrix& phi, double factor, const double* x, double* y);

  int size_, leaders_;         // leaders_: size_ minus followers
  std::vector<double> scale_;  // powers of two
  Matrix balanced_;            // scale^-1 A scale
  double norm_ = 0;            // 1-norm of the leaders' block
  int doublings_ = 1;
  Matrix phi_[highest + 1];  // phi_0 is the exponential function
  Matrix half_[3];           // [0] is not used
  Matrix scratch_;
  std::vector<double> vector_;
};

}  // namespace redysim
