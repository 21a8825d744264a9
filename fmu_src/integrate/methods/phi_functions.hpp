#pragma once

#include <memory>
#include <vector>

namespace redysim {

// The functions phi_k(z) = sum_j z^j / (j + k)! of a matrix h A, k = 1 to 4, times a vector, by scaling and
// squaring of a balanced matrix (Skaflestad, Wright, Appl. Numer. Math. 59, 2009). Only the exponential
// function is computed as a matrix: the doubling formulas are applied to vectors, at n^2 operations each.
class PhiFunctions {
 public:
  // The last `followers` variables do not influence the others, not even by rounding.
  PhiFunctions(int size, int followers);

  void set_matrix(const double* a);  // A, column-major
  bool evaluate(double h);           // false: the exponential function overflows

  // y += factor phi_k(h A) x and, if given, at_half += half_factor phi_k(h A / 2) x.
  void add(int k, double factor, const double* x, double* y, double half_factor = 0,
           double* at_half = nullptr);

  // CPU time of evaluate(h) and of a step's four vectors, in right-hand sides of an open tree of this size.
  // `norm`: norm of h A.
  static double cost(int size, double norm);
  double cost(double h) const { return cost(size_, h * norm_); }

 private:
  using Matrix = std::vector<double>;  // column-major
  static constexpr int highest = 4, most_doublings = 40;

  double* column(Matrix& matrix, int j) const { return &matrix[static_cast<std::size_t>(j) * scale_.size()]; }
  double* exponential(int i);  // e^(2^i z), i < doublings_
  void rescale(int variable, double factor);
  double norm_of_row(int i);
  void expand();
  void multiply(const double* left, const double* x, double* y) const;    // y = left x
  void set_product(const double* left, const double* right, double* to);  // to = left right; may be `right`
  void start_vectors(int k);
  void add_to(double* y, int k, double factor) const;
  void double_argument(const double* exponential, int k);

  int size_, leaders_;         // leaders_: size_ minus followers
  std::vector<double> scale_;  // powers of two
  Matrix balanced_;            // scale^-1 A scale
  double norm_ = 0;            // 1-norm of the leaders' block
  int doublings_ = 1;
  Matrix z_, square_, cube_;  // h A / 2^doublings_, balanced, and its powers
  // Allocated at the first use, for few states at once, so that steps allocate nothing.
  std::unique_ptr<double[]> exponentials_[most_doublings];
  std::vector<double> of_[highest + 1];  // [k]: phi_k times a vector; [0]: the vector
  std::vector<double> product_;
};

}  // namespace redysim
