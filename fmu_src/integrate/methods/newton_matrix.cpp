#include "integrate/methods/newton_matrix.hpp"

#include "integrate/system/dense_lu.hpp"

namespace redysim {
NewtonMatrix::NewtonMatrix(const StateLayout& layout, const std::vector<int>& turning_balls)
    : layout_(layout),
      positions_(layout.q.count),
      others_(layout.size() - layout.q.count),
      factored_(others_ - layout.work.count),
      columns_(static_cast<std::size_t>(others_)),
      pivots_(columns_.size()),
      turning_(turning_balls.size()) {
  for (std::size_t i = 0; i < turning_.size(); ++i) turning_[i].ball = turning_balls[i];
}

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
  turn(x, true);
  double* const others = x + positions_;
  for (int k = 0; k < positions_; ++k) subtract(others_, x[k], columns[k] + positions_, others);
  solve_lu(columns_.data(), factored_, pivots_.data(), others);
  for (int i = factored_; i < others_; ++i)
    for (int j = 0; j < factored_; ++j) others[i] -= columns_[j][i] * others[j];
  for (int k = 0; k < positions_; ++k) x[k] -= columns[layout_.qd[k]][k] * x[layout_.qd[k]];
  turn(x, false);
}

void NewtonMatrix::keep(const double* y, Quaternion TurningBall::*orientation) {
  for (TurningBall& turning : turning_) {
    const double* q = layout_.quaternion.of(y, turning.ball);
    turning.*orientation = Quaternion(q[0], q[1], q[2], q[3]).normalized();
  }
}

// A small rotation p (vector, in the parent's axes) changes the orientation by p * orientation / 2. The
// orientation is therefore replaced by a multiplication from the right.
void NewtonMatrix::turn(double* x, bool to_reference) const {
  for (const TurningBall& turning : turning_) {
    Quaternion rotation = turning.reference.conjugate() * turning.present;
    if (!to_reference) rotation = rotation.conjugate();
    double* q = layout_.quaternion.of(x, turning.ball);
    const Quaternion turned = Quaternion(q[0], q[1], q[2], q[3]) * rotation.conjugate();
    q[0] = turned.w();
    Eigen::Map<Vec3<double>>(q + 1) = turned.vec();
    Eigen::Map<Vec3<double>> omega(layout_.omega.of(x, turning.ball));
    omega = rotation * Vec3<double>(omega);
  }
}

}  // namespace redysim
