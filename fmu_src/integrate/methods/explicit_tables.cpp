#include "integrate/methods/explicit_tables.hpp"

#include "integrate/methods/sundials_objects.hpp"

namespace redysim {
namespace {

// `A` row by row; `b`: weights of the step, `d`: of the embedded order.
template <int stages>
struct Table {
  double c[stages], A[stages * stages], b[stages], d[stages];
};

// clang-format off
constexpr Table<4> third = {
    {0, 1.0 / 2, 3.0 / 4, 1},
    {0, 0, 0, 0,
     1.0 / 2, 0, 0, 0,
     0, 3.0 / 4, 0, 0,
     2.0 / 9, 1.0 / 3, 4.0 / 9, 0},
    {2.0 / 9, 1.0 / 3, 4.0 / 9, 0},
    {7.0 / 24, 1.0 / 4, 1.0 / 3, 1.0 / 8}};

constexpr Table<7> fifth = {
    {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1},
    {0, 0, 0, 0, 0, 0, 0,
     1.0 / 5, 0, 0, 0, 0, 0, 0,
     3.0 / 40, 9.0 / 40, 0, 0, 0, 0, 0,
     44.0 / 45, -56.0 / 15, 32.0 / 9, 0, 0, 0, 0,
     19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729, 0, 0, 0,
     9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656, 0, 0,
     35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84, 0},
    {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84, 0},
    {5179.0 / 57600, 0, 7571.0 / 16695, 393.0 / 640, -92097.0 / 339200, 187.0 / 2100, 1.0 / 40}};

// clang-format on

// SUNDIALS copies the numbers, but takes pointers to mutable ones.
double* read_only(const double* numbers) { return const_cast<double*>(numbers); }

template <int stages>
ButcherTable butcher_table(const Table<stages>& of, int order, int embedded_order) {
  return ButcherTable(sundials::created(ARKodeButcherTable_Create(
      stages, order, embedded_order, read_only(of.c), read_only(of.A), read_only(of.b), read_only(of.d))));
}

}  // namespace

ButcherTable bogacki_shampine_3() { return butcher_table(third, 3, 2); }
ButcherTable dormand_prince_5() { return butcher_table(fifth, 5, 4); }

}  // namespace redysim
