#include "integrate/methods/sundials_objects.hpp"

#include <sunmatrix/sunmatrix_dense.h>

#include <cmath>
#include <cstring>

#include "dynamics/clones.hpp"
#include "integrate/methods/newton_matrix.hpp"
#include "math/vec3.hpp"

namespace redysim::sundials {
namespace {

constexpr int block = 4;  // components that stay in registers while the terms are added

// z[k] = sum c[i] x[i][k] for Count components from `at`, terms in order, without those that a Butcher table
// leaves out: a slope that is not finite makes all later ones so.
template <int Count>
inline void combine_block(int terms, const double* c, const N_Vector* x, long at, double* z) {
  using Block = Eigen::Array<double, Count, 1>;
  using Part = Eigen::Map<const Block>;
  Block sum = c[0] * Part(data(x[0]) + at);
  for (int i = 1; i < terms; ++i)
    if (c[i] != 0) sum += c[i] * Part(data(x[i]) + at);
  Eigen::Map<Block>(z + at) = sum;
}

// block by block, so z may be any of the x
REDYSIM_CLONES int linear_combination(int terms, double* c, N_Vector* x, N_Vector z_vector) {
  const long n = NV_LENGTH_S(z_vector);
  double* z = data(z_vector);
  long at = 0;
  for (; at + block <= n; at += block) combine_block<block>(terms, c, x, at, z);
  if (at + 2 <= n) {
    combine_block<2>(terms, c, x, at, z);
    at += 2;
  }
  if (at < n) combine_block<1>(terms, c, x, at, z);
  return 0;
}

// z[k] = of(k); z may be one of its vectors
template <class Of>
inline void set_each(long n, double* z, Of of) {
#pragma GCC ivdep
  for (long k = 0; k < n; ++k) z[k] = of(k);
}

// z = a x + b y, with the roundings of SUNDIALS' own operation
void linear_sum(double a, N_Vector x_vector, double b, N_Vector y_vector, N_Vector z_vector) {
  const long n = NV_LENGTH_S(z_vector);
  const double *x = data(x_vector), *y = data(y_vector);
  double* z = data(z_vector);
  if (a == b)
    set_each(n, z, [=](long k) { return a * (x[k] + y[k]); });
  else if (a == -b)
    set_each(n, z, [=](long k) { return a * (x[k] - y[k]); });
  else
    set_each(n, z, [=](long k) { return a * x[k] + b * y[k]; });
}

void scale(double factor, N_Vector x, N_Vector z) {
  if (factor != 1.0) return N_VScale_Serial(factor, x, z);
  if (x != z) std::memcpy(data(z), data(x), static_cast<std::size_t>(NV_LENGTH_S(z)) * sizeof(double));
}

double weighted_norm(N_Vector x_vector, N_Vector w_vector) {
  const long n = NV_LENGTH_S(x_vector);
  const double *x = data(x_vector), *w = data(w_vector);
  double sum = 0;
  long counted = 0;
  for (long k = 0; k < n; ++k) {
    const double term = x[k] * w[k];
    sum += term * term;
    counted += w[k] > 0;
  }
  return counted > 0 ? std::sqrt(sum / static_cast<double>(counted)) : 0.0;
}

int copy_matrix(SUNMatrix from, SUNMatrix to) {
  const auto bytes = static_cast<std::size_t>(SM_LDATA_D(from)) * sizeof(double);
  std::memcpy(SM_DATA_D(to), SM_DATA_D(from), bytes);
  return SUNMAT_SUCCESS;
}

int scale_and_add_identity(double factor, SUNMatrix matrix) {
  double* entries = SM_DATA_D(matrix);
  set_each(SM_LDATA_D(matrix), entries, [=](long k) { return factor * entries[k]; });
  for (long k = 0; k < SM_ROWS_D(matrix); ++k) SM_ELEMENT_D(matrix, k, k) += 1;
  return SUNMAT_SUCCESS;
}

SUNMatrix clone_matrix(SUNMatrix matrix) { return make_matrix(SM_ROWS_D(matrix), matrix->sunctx).release(); }

NewtonMatrix& newton_matrix(SUNLinearSolver solver) { return *static_cast<NewtonMatrix*>(solver->content); }

SUNLinearSolver_Type type_of(SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; }

int set_up(SUNLinearSolver solver, SUNMatrix matrix) {
  return newton_matrix(solver).factor(SM_COLS_D(matrix)) ? SUNLS_SUCCESS : SUNLS_LUFACT_FAIL;
}

int solve(SUNLinearSolver solver, SUNMatrix matrix, N_Vector x, N_Vector b, double) {
  scale(1.0, b, x);
  newton_matrix(solver).solve(SM_COLS_D(matrix), data(x));
  return SUNLS_SUCCESS;
}

int free_solver(SUNLinearSolver solver) {
  delete &newton_matrix(solver);
  SUNLinSolFreeEmpty(solver);
  return SUNLS_SUCCESS;
}

}  // namespace

LinearSolver make_linear_solver(const StateLayout& layout, SUNContext context) {
  auto matrix = std::make_unique<NewtonMatrix>(layout);
  SUNLinearSolver solver = created(SUNLinSolNewEmpty(context));
  solver->ops->gettype = type_of;
  solver->ops->setup = set_up;
  solver->ops->solve = solve;
  solver->ops->free = free_solver;
  solver->content = matrix.release();
  return LinearSolver(solver);
}

Matrix make_matrix(long size, SUNContext context) {
  Matrix matrix(created(SUNDenseMatrix(size, size, context)));
  matrix->ops->clone = clone_matrix;
  matrix->ops->copy = copy_matrix;
  matrix->ops->scaleaddi = scale_and_add_identity;
  return matrix;
}

Vector make_vector(long size, SUNContext context) {
  Vector vector(created(N_VNew_Serial(size, context)));
  vector->ops->nvlinearcombination = linear_combination;
  vector->ops->nvlinearsum = linear_sum;
  vector->ops->nvscale = scale;
  vector->ops->nvwrmsnorm = weighted_norm;
  for (long k = 0; k < size; ++k) data(vector)[k] = 0;
  return vector;
}

const char* LastMessage::reason() const {
  const char* comma = std::strncmp(text, "At ", 3) == 0 ? std::strstr(text, ", ") : nullptr;
  return comma ? comma + 2 : text;
}

}  // namespace redysim::sundials
