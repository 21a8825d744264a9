#include "integrate/methods/newton_matrix.hpp"

#include "integrate/system/dense_lu.hpp"

namespace redysim {

NewtonMatrix::NewtonMatrix(const StateLayout& layout)
    : layout_(layout),
      positions_(layout.q.count),
      others_(layout.size() - layout.q.count),
      factored_(others_ - layout.work.count),
      columns_(static_cast<std::size_t>(others_)),
      pivots_(columns_.size()) {}

bool NewtonMatrix::factor(double** columns) {
  for (int k = 0; k < positions_; ++k) {
    const double* const by_position = columns[k] + positions_;
    double* const by_velocity = columns[layout_.qd[k]] + positions_;
    subtract(others_, columns[layout_.qd[k]][k], by_position, by_velocity);
  }
  for (int j = 0; j < others_; ++j) columns_[j] = columns[positions_ + j] + positions_;
  return factor_lu(columns_.data(), factored_, pivots_.data());
}

void NewtonMatrix::solve(double** columns, double* x) {
  double* const others = x + positions_;
  for (int k = 0; k < positions_; ++k) subtract(others_, x[k], columns[k] + positions_, others);
  solve_lu(columns_.data(), factored_, pivots_.data(), others);
  for (int i = factored_; i < others_; ++i)
    for (int j = 0; j < factored_; ++j) others[i] -= columns_[j][i] * others[j];
  for (int k = 0; k < positions_; ++k) x[k] -= columns[layout_.qd[k]][k] * x[layout_.qd[k]];
}

}  // namespace redysim
