#include "integrate/methods/sundials_objects.hpp"

#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>

#include "dynamics/clones.hpp"
#include "math/vec3.hpp"
#include "model/any_of.hpp"

namespace redysim::sundials {
namespace {

// A vector is one block of memory: this header, then its components. All vectors share one table of
// operations.
struct Header {
  _generic_N_Vector vector;  // content: the components
  long size;
};

long size(N_Vector vector) { return reinterpret_cast<const Header*>(vector)->size; }

// Count components, kept in a register while the terms are added.
template <int Count>
struct Part {
  using Type [[gnu::vector_size(Count * sizeof(double)), gnu::aligned(sizeof(double)), gnu::may_alias]] =
      double;
  static const Type& of(N_Vector x, long at) { return *reinterpret_cast<const Type*>(data(x) + at); }
};
template <>
struct Part<1> {
  using Type = double;
  static const Type& of(N_Vector x, long at) { return data(x)[at]; }
};

// z[k] = sum c[i] x[i][k] for Count components from `at`, terms in order. Terms with c[i] = 0 are skipped: a
// slope that is not finite would spoil the result.
template <int Count>
inline void combine_part(int terms, const double* c, const N_Vector* x, long at, double* z) {
  using Type = typename Part<Count>::Type;
  Type sum = c[0] * Part<Count>::of(x[0], at);
  for (int i = 1; i < terms; ++i)
    if (c[i] != 0) sum += c[i] * Part<Count>::of(x[i], at);
  *reinterpret_cast<Type*>(z + at) = sum;
}

// The same for 12 components: three sums at a time hide their latency.
inline void combine_twelve(int terms, const double* c, const N_Vector* x, long at, double* z) {
  using Four = Part<4>;
  Four::Type a = c[0] * Four::of(x[0], at), b = c[0] * Four::of(x[0], at + 4),
             d = c[0] * Four::of(x[0], at + 8);
  for (int i = 1; i < terms; ++i) {
    if (c[i] == 0) continue;
    a += c[i] * Four::of(x[i], at);
    b += c[i] * Four::of(x[i], at + 4);
    d += c[i] * Four::of(x[i], at + 8);
  }
  *reinterpret_cast<Four::Type*>(z + at) = a;
  *reinterpret_cast<Four::Type*>(z + at + 4) = b;
  *reinterpret_cast<Four::Type*>(z + at + 8) = d;
}

// part by part, so z may be any of the x; `wide`: with registers of four doubles
template <bool wide>
inline int linear_combination(int terms, double* c, N_Vector* x, N_Vector z_vector) {
  const long n = size(z_vector);
  double* z = data(z_vector);
  long at = 0;
  if constexpr (wide) {
    for (; at + 12 <= n; at += 12) combine_twelve(terms, c, x, at, z);
    for (; at + 4 <= n; at += 4) combine_part<4>(terms, c, x, at, z);
  }
  for (; at + 2 <= n; at += 2) combine_part<2>(terms, c, x, at, z);
  if (at < n) combine_part<1>(terms, c, x, at, z);
  return 0;
}

REDYSIM_AVX2 int linear_combination_with_avx2(int terms, double* c, N_Vector* x, N_Vector z) {
  return linear_combination<true>(terms, c, x, z);
}

// z[k] = of(k); z may also be an argument of `of`
template <class Of>
inline void set_each(long n, double* z, Of of) {
#pragma GCC ivdep
  for (long k = 0; k < n; ++k) z[k] = of(k);
}

// z = a x + b y, with the roundings of SUNDIALS' own operation
void linear_sum(double a, N_Vector x_vector, double b, N_Vector y_vector, N_Vector z_vector) {
  const long n = size(z_vector);
  const double *x = data(x_vector), *y = data(y_vector);
  double* z = data(z_vector);
  if (a == b)
    set_each(n, z, [=](long k) { return a * (x[k] + y[k]); });
  else if (a == -b)
    set_each(n, z, [=](long k) { return a * (x[k] - y[k]); });
  else
    set_each(n, z, [=](long k) { return a * x[k] + b * y[k]; });
}

// z[k] = of(x[k])
template <class Of>
void set_from(N_Vector x_vector, N_Vector z_vector, Of of) {
  const double* x = data(x_vector);
  set_each(size(z_vector), data(z_vector), [=](long k) { return of(x[k]); });
}

void scale(double factor, N_Vector x, N_Vector z) {
  if (factor != 1.0) return set_from(x, z, [factor](double value) { return factor * value; });
  if (x != z) std::memcpy(data(z), data(x), static_cast<std::size_t>(size(z)) * sizeof(double));
}

void multiply(N_Vector x_vector, N_Vector y_vector, N_Vector z) {
  const double *x = data(x_vector), *y = data(y_vector);
  set_each(size(z), data(z), [=](long k) { return x[k] * y[k]; });
}

void divide(N_Vector x_vector, N_Vector y_vector, N_Vector z) {
  const double *x = data(x_vector), *y = data(y_vector);
  set_each(size(z), data(z), [=](long k) { return x[k] / y[k]; });
}

double dot_product(N_Vector x_vector, N_Vector y_vector) {
  const double *x = data(x_vector), *y = data(y_vector);
  double sum = 0;
  for (long k = 0; k < size(x_vector); ++k) sum += x[k] * y[k];
  return sum;
}

double maximum_norm(N_Vector vector) {
  const double* x = data(vector);
  double largest = 0;
  for (long k = 0; k < size(vector); ++k) largest = std::max(largest, std::fabs(x[k]));
  return largest;
}

double weighted_norm(N_Vector x_vector, N_Vector w_vector) {
  const long n = size(x_vector);
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

N_Vector clone(N_Vector vector);

// Operations that CVODE and ARKODE require or call often; SUNDIALS supplies defaults for the others.
[[gnu::cold]] _generic_N_Vector_Ops vector_operations() {
  _generic_N_Vector_Ops operations{};
  operations.nvclone = clone;
  operations.nvdestroy = [](N_Vector vector) { ::operator delete(vector); };
  operations.nvgetlength = [](N_Vector vector) -> sunindextype { return size(vector); };
  operations.nvgetarraypointer = [](N_Vector vector) { return data(vector); };
  operations.nvlinearsum = linear_sum;
  operations.nvlinearcombination = has_avx2 ? linear_combination_with_avx2 : linear_combination<false>;
  operations.nvconst = [](double value, N_Vector z) {
    set_each(size(z), data(z), [value](long) { return value; });
  };
  operations.nvprod = multiply;
  operations.nvdiv = divide;
  operations.nvscale = scale;
  operations.nvabs = [](N_Vector x, N_Vector z) {
    set_from(x, z, [](double value) { return std::fabs(value); });
  };
  operations.nvinv = [](N_Vector x, N_Vector z) { set_from(x, z, [](double value) { return 1 / value; }); };
  operations.nvaddconst = [](N_Vector x, double term, N_Vector z) {
    set_from(x, z, [term](double value) { return value + term; });
  };
  operations.nvdotprod = dot_product;
  operations.nvmaxnorm = maximum_norm;
  operations.nvwrmsnorm = weighted_norm;
  return operations;
}

[[gnu::cold]] N_Vector new_vector(long size, SUNContext context) {
  static _generic_N_Vector_Ops operations = vector_operations();
  const std::size_t components = static_cast<std::size_t>(size) * sizeof(double);
  auto* header = static_cast<Header*>(::operator new(sizeof(Header) + components, std::nothrow));
  if (!header) return nullptr;
  header->vector.content = std::memset(header + 1, 0, components);
  header->vector.ops = &operations;
  header->vector.sunctx = context;
  header->size = size;
  return &header->vector;
}

N_Vector clone(N_Vector vector) { return new_vector(size(vector), vector->sunctx); }

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

[[gnu::cold]] SUNMatrix clone_matrix(SUNMatrix matrix) {
  return make_matrix(SM_ROWS_D(matrix), matrix->sunctx).release();
}

SUNLinearSolver_Type type_of(SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; }

int set_up(SUNLinearSolver solver, SUNMatrix matrix) {
  return newton_matrix(solver).factor(SM_COLS_D(matrix)) ? SUNLS_SUCCESS : SUNLS_LUFACT_FAIL;
}

int solve(SUNLinearSolver solver, SUNMatrix matrix, N_Vector x, N_Vector b, double) {
  scale(1.0, b, x);
  newton_matrix(solver).solve(SM_COLS_D(matrix), data(x));
  return SUNLS_SUCCESS;
}

// Spherical joints whose body has contacts.
[[gnu::cold]] std::vector<int> balls_with_contacts(const System& system) {
  const auto& pairs = system.plan().contact_pairs;
  std::vector<int> balls;
  for (int ball = 0; ball < system.balls(); ++ball) {
    const int body = system.plan().balls[ball] + 3;
    if (any_of(pairs,
               [body](const auto& pair) { return pair.sphere_body == body || pair.surface_body == body; }))
      balls.push_back(ball);
  }
  return balls;
}

[[gnu::cold]] int free_solver(SUNLinearSolver solver) {
  delete &newton_matrix(solver);
  SUNLinSolFreeEmpty(solver);
  return SUNLS_SUCCESS;
}

}  // namespace

[[gnu::cold]] LinearSolver make_linear_solver(const System& system, SUNContext context) {
  auto matrix = std::make_unique<NewtonMatrix>(system.layout(), balls_with_contacts(system));
  SUNLinearSolver solver = created(SUNLinSolNewEmpty(context));
  solver->ops->gettype = type_of;
  solver->ops->setup = set_up;
  solver->ops->solve = solve;
  solver->ops->free = free_solver;
  solver->content = matrix.release();
  return LinearSolver(solver);
}

[[gnu::cold]] Matrix make_matrix(long size, SUNContext context) {
  Matrix matrix(created(SUNDenseMatrix(size, size, context)));
  matrix->ops->clone = clone_matrix;
  matrix->ops->copy = copy_matrix;
  matrix->ops->scaleaddi = scale_and_add_identity;
  return matrix;
}

Vector make_vector(long size, SUNContext context) { return Vector(created(new_vector(size, context))); }

const char* LastMessage::reason() const {
  const char* comma = std::strncmp(text, "At ", 3) == 0 ? std::strstr(text, ", ") : nullptr;
  return comma ? comma + 2 : text;
}

}  // namespace redysim::sundials
