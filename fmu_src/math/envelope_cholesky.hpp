#pragma once

#include <cmath>
#include <vector>

namespace redysim {

// Cholesky factor L L^T = S of a symmetric positive semidefinite matrix stored by rows from its first
// coupled column to the diagonal (envelope). No fill-in outside the envelope (George and Liu 1981, 4.2).
//
// Rank: rows come in groups of one unit and size (the directions of one point, say). Row k is dependent when
// its pivot, the part of S_kk that the rows before it do not explain, is at most the rank tolerance times
// the largest diagonal of its group: a row that fades away counts like one that turns into its neighbours.
// Its column of L is then zero. Solves return the least-norm solution.
template <class Scalar>
class EnvelopeCholesky {
 public:
  static constexpr double zero_group =
      1e-22;  // rows this small against the largest of all are no constraints
  // between these parts of its group a pivot is doubtful: a dependent row, or one of other inertias
  static constexpr double rounding = 1e-14, small_pivot = 1e-4;
  static constexpr double lost = 1e-12;  // of a row of B: what is left has no direction any more

  // `group` per row, ascending from 0.
  EnvelopeCholesky(std::vector<int> first_column, std::vector<int> group);

  int size() const { return static_cast<int>(first_.size()); }
  int rank() const { return rank_; }

  void set_zero();
  Scalar& entry(int row, int column) { return S_[offset_[row] + column]; }  // first(row) <= column <= row

  // Rows begin to end - 1 become zero, and so do their columns: they are no constraints.
  void clear(int begin, int end);

  // S (lower envelope) -> factor; S is overwritten.
  void factor(double rank_tolerance);

  // As above, but the rows that count as dependent are those of `other`, where S itself can tell.
  void factor_like(const EnvelopeCholesky& other);

  // The same of S = B B^T from the rows of B, `columns` numbers each, without squaring B's condition: row by
  // row by Gram-Schmidt, twice. B becomes orthonormal rows Q, B = L Q.
  void factor_product(Scalar* B, int columns, const EnvelopeCholesky& other);

  // Whether the last factor() met a pivot that is small, yet above rounding: against its group.
  bool doubtful() const { return doubtful_; }

  // x = S^+ b, b of length size(); x and b may be the same array.
  void solve(const Scalar* b, Scalar* x);

  // L^T x of the last solve, without its cancellations: B^T x = Q^T of it.
  const std::vector<Scalar>& along() const { return along_; }

 private:
  Scalar& gram(int row, int column) { return G_[offset_[row] + column]; }
  void forward(const std::vector<Scalar>& L, const std::vector<char>& skipped, Scalar* x) const;
  void backward(const std::vector<Scalar>& L, const std::vector<char>& skipped, Scalar* x) const;
  template <class Keep>
  void factor_rows(Keep keep);
  void factor_gram();

  std::vector<int> first_;   // first stored column of a row
  std::vector<int> offset_;  // S_[offset_[row] + column]
  std::vector<Scalar> S_;    // S, then L
  std::vector<Scalar> G_;    // factor of L^T L, only for a deficient rank
  std::vector<int> group_;
  std::vector<Scalar> scale_;  // largest diagonal per group
  std::vector<char> skipped_;
  std::vector<Scalar> work_, along_;
  int rank_ = 0;
  bool doubtful_ = false;
};

template <class Scalar>
EnvelopeCholesky<Scalar>::EnvelopeCholesky(std::vector<int> first_column, std::vector<int> group)
    : first_(std::move(first_column)), group_(std::move(group)) {
  // the Gram matrix L^T L couples columns that meet in a row: keep first_ monotone so that it fits as well
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
  work_.assign(first_.size(), Scalar(0));
  along_ = work_;
  scale_.assign(group_.empty() ? 0 : static_cast<std::size_t>(group_.back()) + 1, Scalar(0));
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::set_zero() {
  for (auto& value : S_) value = Scalar(0);
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::clear(int begin, int end) {
  for (int row = begin; row < size(); ++row)
    for (int column = first_[row]; column <= row; ++column)
      if (row < end || (column >= begin && column < end)) entry(row, column) = Scalar(0);
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::factor(double rank_tolerance) {
  Scalar largest(0);
  for (auto& scale : scale_) scale = Scalar(0);
  for (int k = 0; k < size(); ++k) {
    if (entry(k, k) > largest) largest = entry(k, k);
    if (entry(k, k) > scale_[group_[k]]) scale_[group_[k]] = entry(k, k);
  }
  doubtful_ = false;
  factor_rows([&](int row, const Scalar& pivot) {
    const Scalar& scale = scale_[group_[row]];
    if (!(scale > zero_group * largest)) return false;
    doubtful_ = doubtful_ || (pivot > rounding * scale && pivot < small_pivot * scale);
    return pivot > rank_tolerance * scale;
  });
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::factor_like(const EnvelopeCholesky& other) {
  factor_rows([&](int row, const Scalar& pivot) { return !other.skipped_[row] && pivot > Scalar(0); });
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::factor_product(Scalar* B, int columns, const EnvelopeCholesky& other) {
  using std::sqrt;
  set_zero();
  rank_ = 0;
  const auto product = [=](int i, int j) {
    Scalar sum(0);
    for (int k = 0; k < columns; ++k) sum += B[i * columns + k] * B[j * columns + k];
    return sum;
  };
  for (int i = 0; i < size(); ++i) {
    const Scalar whole = sqrt(product(i, i));
    for (int repeat = 0; repeat < 2; ++repeat)
      for (int j = first_[i]; j < i; ++j) {
        if (skipped_[j]) continue;
        const Scalar along = product(i, j);
        entry(i, j) += along;
        for (int k = 0; k < columns; ++k) B[i * columns + k] -= along * B[j * columns + k];
      }
    const Scalar length = sqrt(product(i, i));
    skipped_[i] = other.skipped_[i] || !(length > lost * whole);
    entry(i, i) = skipped_[i] ? Scalar(0) : length;
    for (int k = 0; k < columns; ++k)
      B[i * columns + k] = skipped_[i] ? Scalar(0) : Scalar(B[i * columns + k] / length);
    rank_ += skipped_[i] ? 0 : 1;
  }
  if (rank_ < size()) factor_gram();
}

template <class Scalar>
template <class Keep>
void EnvelopeCholesky<Scalar>::factor_rows(Keep keep) {
  using std::sqrt;
  rank_ = 0;
  for (int i = 0; i < size(); ++i) {
    Scalar pivot = entry(i, i);
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
    skipped_[i] = !keep(i, pivot);
    entry(i, i) = skipped_[i] ? Scalar(0) : Scalar(sqrt(pivot));
    rank_ += skipped_[i] ? 0 : 1;
  }
  if (rank_ < size()) factor_gram();
}

// G = L^T L over the kept columns, then its own Cholesky factor in place.
template <class Scalar>
void EnvelopeCholesky<Scalar>::factor_gram() {
  using std::sqrt;
  for (auto& value : G_) value = Scalar(0);
  for (int row = 0; row < size(); ++row)
    for (int i = first_[row]; i <= row; ++i)
      for (int j = first_[row] > first_[i] ? first_[row] : first_[i]; j <= i; ++j)
        gram(i, j) += entry(row, i) * entry(row, j);
  for (int i = 0; i < size(); ++i) {
    if (skipped_[i]) continue;
    for (int j = first_[i]; j <= i; ++j) {
      if (skipped_[j]) continue;
      Scalar sum = gram(i, j);
      const int from = first_[i] > first_[j] ? first_[i] : first_[j];
      for (int k = from; k < j; ++k)
        if (!skipped_[k]) sum -= gram(i, k) * gram(j, k);
      gram(i, j) = i == j ? Scalar(sqrt(sum)) : Scalar(sum / gram(j, j));
    }
  }
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::forward(const std::vector<Scalar>& L, const std::vector<char>& skipped,
                                       Scalar* x) const {
  for (int i = 0; i < size(); ++i) {
    if (skipped[i]) {
      x[i] = Scalar(0);
      continue;
    }
    for (int j = first_[i]; j < i; ++j) x[i] -= L[offset_[i] + j] * x[j];
    x[i] /= L[offset_[i] + i];
  }
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::backward(const std::vector<Scalar>& L, const std::vector<char>& skipped,
                                        Scalar* x) const {
  for (int i = size() - 1; i >= 0; --i) {
    if (skipped[i]) {
      x[i] = Scalar(0);
      continue;
    }
    x[i] /= L[offset_[i] + i];
    for (int j = first_[i]; j < i; ++j) x[j] -= L[offset_[i] + j] * x[i];
  }
}

template <class Scalar>
void EnvelopeCholesky<Scalar>::solve(const Scalar* b, Scalar* x) {
  if (rank_ == size()) {
    if (x != b)
      for (int i = 0; i < size(); ++i) x[i] = b[i];
    forward(S_, skipped_, x);
    for (int i = 0; i < size(); ++i) along_[i] = x[i];
    backward(S_, skipped_, x);
    return;
  }
  // S^+ = L (L^T L)^-2 L^T for the m x rank factor L
  for (int j = 0; j < size(); ++j) work_[j] = Scalar(0);
  for (int i = 0; i < size(); ++i)
    for (int j = first_[i]; j <= i; ++j) work_[j] += entry(i, j) * b[i];
  for (int repeat = 0; repeat < 2; ++repeat) {
    forward(G_, skipped_, work_.data());
    backward(G_, skipped_, work_.data());
    if (repeat == 0) along_ = work_;
  }
  for (int i = 0; i < size(); ++i) {
    x[i] = Scalar(0);
    for (int j = first_[i]; j <= i; ++j) x[i] += entry(i, j) * work_[j];
  }
}

}  // namespace redysim
