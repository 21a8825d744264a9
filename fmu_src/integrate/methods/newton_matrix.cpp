#include "integrate/methods/newton_matrix.hpp"

#include <sundials/sundials_dense.h>

#include <type_traits>

namespace redysim {

static_assert(std::is_same_v<sunindextype, std::int64_t>);

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
    const double gamma = -columns[layout_.qd[k]][k];
    for (int i = 0; i < others_; ++i) by_velocity[i] += gamma * by_position[i];
  }
  for (int j = 0; j < others_; ++j) columns_[j] = columns[positions_ + j] + positions_;
  return SUNDlsMat_denseGETRF(columns_.data(), factored_, factored_, pivots_.data()) == 0;
}

void NewtonMatrix::solve(double** columns, double* x) {
  double* const others = x + positions_;
  for (int k = 0; k < positions_; ++k) {
    const double* const by_position = columns[k] + positions_;
    for (int i = 0; i < others_; ++i) others[i] -= by_position[i] * x[k];
  }
  SUNDlsMat_denseGETRS(columns_.data(), factored_, pivots_.data(), others);
  for (int i = factored_; i < others_; ++i)
    for (int j = 0; j < factored_; ++j) others[i] -= columns_[j][i] * others[j];
  for (int k = 0; k < positions_; ++k) x[k] -= columns[layout_.qd[k]][k] * x[layout_.qd[k]];
}

}  // namespace redysim
