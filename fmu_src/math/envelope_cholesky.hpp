#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "math/lever_rows.hpp"
#include "math/row_operations.hpp"

namespace redysim {

// Cholesky factorization L L^T = S of a symmetric positive semidefinite matrix. Each row is stored from its
// first nonzero column to the diagonal (envelope); no fill-in occurs outside (George and Liu 1981, 4.2).
//
// Rank: a lever is the generalized force of a row's unit multiplier on a joint. The scale of a row is the
// value that S_kk would have if its levers did not cancel. The pivot of row k is the part of S_kk that does
// not follow from the preceding rows. If it is at most the pivot tolerance times the scale, the row is
// dependent and its column of L is zero. The relative pivot is the squared sine of the angle between the row
// and the preceding rows.
template <class Scalar>
class EnvelopeCholesky {
 public:
  // between these relative pivots the rank is uncertain: dependent row or inertias of very different
  // magnitude
  static constexpr double rounding = 1e-14, small_pivot = 1e-4;
  static constexpr double lost = 1e-12;         // relative remainder of a row with an inaccurate direction
  static constexpr double cancelled = 1e-2;     // pivot relative to S_kk below which digits are lost
  static constexpr double unexplained = 1e-11;  // maximum relative component due to rounding
  static constexpr double least_sine = 1e-7;    // tolerance of a marked row, square root of `rounding`
  static constexpr int largest_reordered = 64;  // rows, also of those that allocate in no step

  // `may_reorder`: find_dependent() may reorder the rows, of which there are at most `largest_reordered`.
  [[gnu::cold]] explicit EnvelopeCholesky(std::vector<int> first_column, bool may_reorder = false);

  int size() const { return static_cast<int>(first_.size()); }
  int rank() const { return rank_; }
  bool dependent(int row) const { return skipped_[row]; }

  void set_zero();
  Scalar& entry(int row, int column) { return S_[offset_[row] + column]; }  // first(row) <= column <= row
  Scalar* entries_of(int row) { return S_.data() + offset_[row]; }          // indexed by column

  // Replaces S (lower envelope) by its factor. `scale`: one per row.
  void factor(const Scalar* scale, double pivot_tolerance);

  // Whether the last factor() found a pivot that was small but larger than rounding.
  bool doubtful() const { return doubtful_; }

  // Whether the pivot of an independent row lost digits in the last factor().
  bool inexact() const { return inexact_; }

  // Until it is called with `false`, only `rank()` rows may be independent in factor() and find_dependent():
  // of the rows of the last factor, those with the largest pivots relative to their scale.
  [[gnu::cold, gnu::noinline]] void hold_rank(bool hold);

  // Determines the dependent rows for factor_product() from the levers alone. Rows are taken in turn; a row
  // of which a smaller part remains beside those taken before waits until only such rows are left. A row is
  // dependent if no entry of the remainder exceeds `sine_tolerance` times the bounds that contributed to it,
  // and its error. The units of rows and columns have no influence. Overwrites J.
  //
  // If a dependent row has a component along a later independent one, the dependent rows move to the end
  // until the next factor() or find_dependent(), where allowed: L then contains all their components.
  [[gnu::cold, gnu::noinline]] void find_dependent(LeverRows J, double sine_tolerance);

  // Index of a row in B.
  int position(int row) const { return reordered_now_ ? position_[row] : row; }

  // Factor of S = B B^T by Gram-Schmidt on the rows of B (each row twice), which does not square the
  // condition number of B. B is row-major and is overwritten by Q with orthonormal rows, B = L Q. Dependent
  // rows: those of find_dependent().
  [[gnu::cold]] void factor_product(Scalar* B, int columns);

  // Marks the rows omitted by the last factor_product() that find_dependent() shall keep until the next
  // factor(): those that b needs by more than the passage of a singular configuration, rounding and the
  // residuals explain (docs/derivations/loops.md, (8)). squared_bound: of the levers of each row;
  // squared_spin: of the angular velocities. squared_force: of the forces on the joints, in the metric of S.
  // Returns whether there is a new one.
  [[gnu::cold, gnu::noinline]] bool mark_needed(const Scalar* b, const Scalar* residual,
                                                const Scalar* squared_bound, double squared_spin,
                                                double squared_force);

  // Solves S x = b in the least-squares sense. x has minimum norm, with each row in units of its scale. x and
  // b may be the same array.
  void solve(const Scalar* b, Scalar* x);

  // Replaces x of the last solve() by the vector with the same S x and minimum norm in the units of the rows.
  void reduce_norm(Scalar* x) {
    if (rank_ < size()) reduce_norm_of_dependent(x);
  }

  // L^T x of the last solve() without cancellation; B^T x = Q^T L^T x.
  const std::vector<Scalar>& along() const { return reordered_now_ ? reordered_[0].along_ : along_; }

 private:
  double tolerance_of(int row, double usual) const { return needed_[row] ? least_sine : usual; }
  // A held row may depend on later rows, which its row of L cannot contain.
  void leave_out(int row) {
    for (int j = first_[row]; j <= row; ++j) entry(row, j) = Scalar(0);
    skipped_[row] = true;
    needed_[row] = false;
  }
  [[gnu::cold, gnu::noinline]] void take_direction(LeverRows& J, int i);
  [[gnu::cold, gnu::noinline]] double squared_combination(int row);
  [[gnu::cold, gnu::noinline]] void set_null_vector(int row, Scalar* null) const;
  [[gnu::cold, gnu::noinline]] void reorder();
  template <class Operation>
  [[gnu::cold, gnu::noinline]] void in_new_order(const Scalar* b, Scalar* x, Operation operation);
  void forward(const std::vector<Scalar>& L, Scalar* x) const;
  void backward(const std::vector<Scalar>& L, Scalar* x) const;
  [[gnu::noinline]] void factor_gram();
  void set_gram();
  Scalar& gram(int row, int column) { return G_[offset_[row] + column]; }
  void solve_gram(Scalar* x);
  Scalar line(int row, const std::vector<Scalar>& x) const;            // one entry of L x
  void add_columns(const Scalar* x, bool weighted, Scalar* to) const;  // L^T x, or L^T W x
  [[gnu::noinline]] void improve(Scalar* x);
  // not inlined, for smaller code
  [[gnu::noinline]] void solve_dependent(const Scalar* b, Scalar* x);
  [[gnu::noinline]] void reduce_norm_of_dependent(Scalar* x);

  std::vector<int> first_;      // first stored column of a row
  std::vector<int> offset_;     // S_[offset_[row] + column]
  std::vector<Scalar> S_;       // S, then L
  std::vector<Scalar> G_;       // factor of L^T W L, computed on first use if rank deficient
  std::vector<Scalar> weight_;  // W: reciprocal scale of each row
  std::vector<char> skipped_, needed_, held_;
  std::vector<char> levers_;  // in find_dependent: 0 or the following flags
  static constexpr char small = 1, large = 2, explained_later = 4;
  std::vector<Scalar> work_, along_, left_;
  std::vector<Scalar> square_;  // one line per row of L, for hold_rank(), reduce_norm() and mark_needed()
  int rank_ = 0;
  bool doubtful_ = false, inexact_ = false, has_gram_ = false;
  std::vector<EnvelopeCholesky> reordered_;  // at most one, with full rows in another order
  std::vector<int> position_;                // of each row in reordered_
  bool reordered_now_ = false;
};

template <class Scalar>
EnvelopeCholesky<Scalar>::EnvelopeCholesky(std::vector<int> first_column, bool may_reorder)
    : first_(std::move(first_column)) {
  // with monotone first_, the Gram matrix L^T W L (coupling columns with a common row) has the same envelope
  for (int row = size() - 2; row >= 0; --row)
    if (first_[row] > first_[row + 1]) first_[row] = first_[row + 1];
  int begin = 0;
  for (int row = 0; row < size(); ++row) {
    offset_.push_back(begin - first_[row]);
    begin += row - first_[row] + 1;
  }
  S_.assign(begin, Scalar(0));
  G_.assign(begin, Scalar(0));
  skipped_.assign(first_.size(), 0);
  needed_ = held_ = levers_ = skipped_;
  work_.assign(first_.size(), Scalar(0));
  along_ = left_ = weight_ = work_;
  if (size() <= largest_reordered) square_.reserve(first_.size() * first_.size());
  if (!may_reorder || size() > largest_reordered) return;
  position_.assign(first_.size(), 0);
  reordered_.emplace_back(std::as_const(position_), /*may_reorder=*/false);
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::set_zero() {
  for (auto& value : S_) value = Scalar(0);
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::factor(const Scalar* scale, double pivot_tolerance) {
  using std::sqrt;
  rank_ = 0;
  doubtful_ = inexact_ = reordered_now_ = false;
  has_gram_ = false;
  for (int i = 0; i < size(); ++i) {
    weight_[i] = scale[i] > Scalar(0) ? Scalar(Scalar(1) / scale[i]) : Scalar(0);
    if (held_[i]) {
      leave_out(i);
      continue;
    }
    const Scalar whole = entry(i, i);
    Scalar pivot = whole;
    for (int j = first_[i]; j < i; ++j) {
      if (skipped_[j]) {
        entry(i, j) = Scalar(0);
        continue;
      }
      Scalar sum = entry(i, j);
      const int from = first_[i] > first_[j] ? first_[i] : first_[j];
      for (int k = from; k < j; ++k) sum -= entry(i, k) * entry(j, k);
      entry(i, j) = sum / entry(j, j);
      pivot -= entry(i, j) * entry(i, j);
    }
    needed_[i] = false;
    doubtful_ = doubtful_ || (pivot > rounding * scale[i] && pivot < small_pivot * scale[i]);
    skipped_[i] = !(pivot > pivot_tolerance * scale[i]);
    entry(i, i) = skipped_[i] ? Scalar(0) : Scalar(sqrt(pivot));
    inexact_ = inexact_ || (pivot < cancelled * whole && !skipped_[i]);
    rank_ += skipped_[i] ? 0 : 1;
  }
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::find_dependent(LeverRows J, double sine_tolerance) {
  reordered_now_ = false;
  for (int i = 0; i < size(); ++i) {
    skipped_[i] = true;
    levers_[i] = 0;
    if (held_[i] || !J.normalize(i)) continue;
    levers_[i] = J.exceeds(i, tolerance_of(i, sine_tolerance)) ? large : small;
  }
  for (const double threshold : {1e-1, 1e-2, 1e-3, 1e-4, 0.0})
    for (int i = 0; i < size(); ++i)
      if (skipped_[i] && levers_[i] & large &&
          J.exceeds(i, std::max(threshold, tolerance_of(i, sine_tolerance))))
        take_direction(J, i);
  for (int i = 0; i < size() && !reordered_now_ && !reordered_.empty(); ++i)
    if (skipped_[i] && levers_[i] & explained_later) reorder();
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::take_direction(LeverRows& J, int i) {
  J.make_direction(i);
  for (int j = 0; j < size(); ++j)
    if (!skipped_[j]) J.correct(i, j);
  skipped_[i] = false;
  for (int row = 0; row < size(); ++row) {
    if (!skipped_[row] || levers_[row] == 0) continue;
    const double part = J.subtract(row, i);
    if (row < i && std::abs(part) > unexplained) levers_[row] |= explained_later;
  }
}

// Sets `null`, zeros before, to the vector of the null space of L^T with 1 at a dependent row.
template <class Scalar>
void EnvelopeCholesky<Scalar>::set_null_vector(int row, Scalar* null) const {
  for (int j = first_[row]; j < row; ++j) null[j] = -S_[offset_[row] + j];
  backward(S_, null);
  null[row] = Scalar(1);
}

// Squared length of the combination of a dependent row and independent ones before it that S makes small,
// relative to their scales and to the share of this row.
template <class Scalar>
double EnvelopeCholesky<Scalar>::squared_combination(int row) {
  square_.assign(first_.size(), Scalar(0));
  set_null_vector(row, square_.data());
  double squared = 1;
  for (int j = first_[row]; j < row; ++j) {
    const double share = value_of(square_[j]);
    if (!skipped_[j]) squared += share * share * value_of(weight_[row]) / value_of(weight_[j]);
  }
  return squared;
}

// Gram-Schmidt on the rows of L, each divided by the root of its scale; the longest remaining row comes next.
template <class Scalar>
void EnvelopeCholesky<Scalar>::hold_rank(bool hold) {
  using std::sqrt;
  const int n = size();
  std::fill(held_.begin(), held_.end(), hold && rank_ < n);
  if (!hold || rank_ == n) return;
  const EnvelopeCholesky& L = reordered_now_ ? reordered_[0] : *this;
  square_.assign(static_cast<std::size_t>(n) * n, Scalar(0));
  const auto free_row = [&](int row) { return square_.data() + static_cast<std::ptrdiff_t>(row) * n; };
  for (int row = 0; row < n; ++row) {
    const int i = position(row);
    for (int k = L.first_[i]; k <= i; ++k) free_row(row)[k] = L.S_[L.offset_[i] + k] * sqrt(L.weight_[i]);
  }
  for (int count = 0; count < rank_; ++count) {
    int longest = 0;
    Scalar most(0);
    for (int row = 0; row < n; ++row) {
      const Scalar length = held_[row] ? row_length(free_row(row), n) : Scalar(0);
      if (length > most) most = length, longest = row;
    }
    held_[longest] = false;
    for (int row = 0; row < n; ++row)
      if (held_[row]) subtract_component(free_row(row), free_row(longest), most * most, n);
  }
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::reorder() {
  reordered_now_ = true;
  int next = 0;
  for (const bool dependent : {false, true})
    for (int row = 0; row < size(); ++row) {
      if (bool(skipped_[row]) != dependent) continue;
      reordered_[0].weight_[next] = weight_[row];
      reordered_[0].skipped_[next] = skipped_[row];
      reordered_[0].held_[next] = held_[row];
      position_[row] = next++;
    }
}

// Calls operation(reordered_[0], values). `values` contains b before and x after the call, both in the new
// order.
template <class Scalar>
template <class Operation>
void EnvelopeCholesky<Scalar>::in_new_order(const Scalar* b, Scalar* x, Operation operation) {
  for (int row = 0; row < size(); ++row) work_[position_[row]] = b[row];
  operation(reordered_[0], work_.data());
  for (int row = 0; row < size(); ++row) x[row] = work_[position_[row]];
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::factor_product(Scalar* B, int columns) {
  if (reordered_now_) {
    reordered_[0].factor_product(B, columns);
    rank_ = reordered_[0].rank_;
    for (int row = 0; row < size(); ++row) skipped_[row] = reordered_[0].skipped_[position_[row]];
    return;
  }
  set_zero();
  rank_ = 0;
  has_gram_ = false;
  for (int i = 0; i < size(); ++i) {
    Scalar* row = B + static_cast<std::ptrdiff_t>(i) * columns;
    if (held_[i]) {
      leave_out(i);
      scale_row(row, columns, Scalar(0));
      continue;
    }
    const Scalar whole = row_length(row, columns);
    orthogonalize(B, columns, i, first_[i], skipped_,
                  [&](int j, const Scalar& part) { entry(i, j) += part; });
    const Scalar length = row_length(row, columns);
    left_[i] = length * length;
    if (!(length > lost * whole)) skipped_[i] = true;
    entry(i, i) = skipped_[i] ? Scalar(0) : length;
    scale_row(row, columns, skipped_[i] ? Scalar(0) : Scalar(Scalar(1) / length));
    rank_ += skipped_[i] ? 0 : 1;
  }
}

template <class Scalar>
bool EnvelopeCholesky<Scalar>::mark_needed(const Scalar* b, const Scalar* residual,
                                           const Scalar* squared_bound, double squared_spin,
                                           double squared_force) {
  constexpr double passage = 1e3, least = 1e-28, violation = 1e-2;
  EnvelopeCholesky& L = reordered_now_ ? reordered_[0] : *this;
  // length of the forces and of L^-1 b without the rows that may be close to a singular configuration
  double squared = squared_force;
  bool any = false;
  for (int i = 0; i < size(); ++i) {
    int row = i;
    for (int k = 0; k < size() && reordered_now_; ++k)
      if (position_[k] == i) row = k;
    const double whole = value_of(b[row]), weight = value_of(L.weight_[i]),
                 pivot = value_of(L.left_[i]) * weight, bound = value_of(squared_bound[row]),
                 gap = value_of(residual[row]);
    double left = whole, regular = whole;
    for (int j = L.first_[i]; j < i; ++j) {
      left -= value_of(L.entry(i, j)) * value_of(L.work_[j]);
      regular -= value_of(L.entry(i, j)) * value_of(L.along_[j]);
    }
    L.work_[i] = L.along_[i] = 0;
    if (L.skipped_[i]) {
      if (needed_[row] || held_[row]) continue;
      const double part = left * pivot, size = squared_spin * squared_spin * bound + squared / weight,
                   length = L.squared_combination(i),
                   least_part = passage * pivot * pivot * pivot +
                                length * length * length * (least + violation * gap * gap / bound);
      if (part * part > size * least_part) needed_[row] = any = true;
      continue;
    }
    L.work_[i] = left / value_of(L.entry(i, i));
    if (pivot < small_pivot) continue;
    L.along_[i] = regular / value_of(L.entry(i, i));
    squared += value_of(L.along_[i]) * value_of(L.along_[i]);
  }
  return any;
}

// Sets the lower envelope of G = L^T W L.
template <class Scalar>
void EnvelopeCholesky<Scalar>::set_gram() {
  for (auto& value : G_) value = Scalar(0);
  for (int row = 0; row < size(); ++row)
    for (int i = first_[row]; i <= row; ++i) {
      const Scalar part = weight_[row] * entry(row, i);
      for (int j = first_[row] > first_[i] ? first_[row] : first_[i]; j <= i; ++j)
        gram(i, j) += part * entry(row, j);
    }
}

// Cholesky factor of G for the independent rows, in place. If the units of rows differ by many orders of
// magnitude, rounding may eliminate a pivot. The lower limit of pivots then affects the norm of the solution,
// but not its accuracy.
template <class Scalar>
void EnvelopeCholesky<Scalar>::factor_gram() {
  using std::sqrt;
  constexpr double smallest_pivot = 1e-15;
  set_gram();
  has_gram_ = true;
  for (int i = 0; i < size(); ++i) {
    if (skipped_[i]) continue;
    const Scalar least = smallest_pivot * gram(i, i);
    for (int j = first_[i]; j <= i; ++j) {
      if (skipped_[j]) continue;
      Scalar sum = gram(i, j);
      const int from = first_[i] > first_[j] ? first_[i] : first_[j];
      for (int k = from; k < j; ++k)
        if (!skipped_[k]) sum -= gram(i, k) * gram(j, k);
      gram(i, j) = i == j ? Scalar(sqrt(sum > least ? sum : least)) : Scalar(sum / gram(j, j));
    }
  }
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::solve_gram(Scalar* x) {
  if (!has_gram_) factor_gram();
  forward(G_, x);
  backward(G_, x);
}

template <class Scalar>
Scalar EnvelopeCholesky<Scalar>::line(int row, const std::vector<Scalar>& x) const {
  Scalar sum(0);
  for (int j = first_[row]; j <= row; ++j) sum += S_[offset_[row] + j] * x[j];
  return sum;
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::add_columns(const Scalar* x, bool weighted, Scalar* to) const {
  for (int i = 0; i < size(); ++i) {
    const Scalar value = weighted ? Scalar(weight_[i] * x[i]) : x[i];
    for (int j = first_[i]; j <= i; ++j) to[j] += S_[offset_[i] + j] * value;
  }
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::forward(const std::vector<Scalar>& L, Scalar* x) const {
  for (int i = 0; i < size(); ++i) {
    if (skipped_[i]) {
      x[i] = Scalar(0);
      continue;
    }
    for (int j = first_[i]; j < i; ++j) x[i] -= L[offset_[i] + j] * x[j];
    x[i] /= L[offset_[i] + i];
  }
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::backward(const std::vector<Scalar>& L, Scalar* x) const {
  for (int i = size() - 1; i >= 0; --i) {
    if (skipped_[i]) {
      x[i] = Scalar(0);
      continue;
    }
    x[i] /= L[offset_[i] + i];
    for (int j = first_[i]; j < i; ++j) x[j] -= L[offset_[i] + j] * x[i];
  }
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::solve(const Scalar* b, Scalar* x) {
  if (rank_ < size() || reordered_now_) return solve_dependent(b, x);
  if (x != b)
    for (int i = 0; i < size(); ++i) x[i] = b[i];
  forward(S_, x);
  for (int i = 0; i < size(); ++i) along_[i] = x[i];
  backward(S_, x);
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::solve_dependent(const Scalar* b, Scalar* x) {
  if (reordered_now_)
    return in_new_order(b, x, [](EnvelopeCholesky& S, Scalar* values) { S.solve(values, values); });
  // c = (L^T W L)^-1 L^T W b, with one step of iterative refinement
  for (int i = 0; i < size(); ++i) {
    along_[i] = Scalar(0);
    left_[i] = b[i];
  }
  for (int repeat = 0; repeat < 2; ++repeat) {
    for (int i = 0; i < size(); ++i) work_[i] = Scalar(0);
    add_columns(left_.data(), true, work_.data());
    solve_gram(work_.data());
    for (int i = 0; i < size(); ++i) along_[i] += work_[i];
    for (int i = 0; i < size() && repeat == 0; ++i) left_[i] = b[i] - line(i, along_);
  }
  for (int i = 0; i < size(); ++i) x[i] = Scalar(0);
  for (int repeat = 0; repeat < 2; ++repeat) improve(x);
}

// x += W L (L^T W L)^-1 (c - L^T x): then L^T x = c.
template <class Scalar>
void EnvelopeCholesky<Scalar>::improve(Scalar* x) {
  for (int i = 0; i < size(); ++i) left_[i] = -x[i];
  for (int i = 0; i < size(); ++i) work_[i] = along_[i];
  add_columns(left_.data(), false, work_.data());
  solve_gram(work_.data());
  for (int i = 0; i < size(); ++i) x[i] += weight_[i] * line(i, work_);
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::reduce_norm_of_dependent(Scalar* x) {
  if (reordered_now_)
    return in_new_order(x, x,
                        [](EnvelopeCholesky& S, Scalar* values) { S.reduce_norm_of_dependent(values); });
  // subtracts the components along the null space of L^T: unlike L (L^T L)^-1 L^T x with all digits, also if
  // the units of the rows differ by orders of magnitude
  const int n = size();
  square_.assign(static_cast<std::size_t>(n) * n, Scalar(0));
  Scalar* null = square_.data();
  for (int row = 0; row < n; ++row) {
    if (!skipped_[row]) continue;
    set_null_vector(row, null);
    for (const Scalar* before = square_.data(); before < null; before += n)
      subtract_component(null, before, Scalar(1), n);
    scale_row(null, n, Scalar(1) / row_length(null, n));
    subtract_component(x, null, Scalar(1), n);
    null += n;
  }
}

}  // namespace redysim
