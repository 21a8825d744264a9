#include "integrate/methods/newton_matrix.hpp"

#include "integrate/system/dense_lu.hpp"

namespace redysim {
NewtonMatrix::NewtonMatrix(const StateLayout& layout, const std::vector<int>& turning_balls)
    : layout_(layout),
      positions_(layout.q.count),
      others_(layout.size() - layout.q.count),
      factored_(others_ - layout.work.count),
      columns_(static_cast<std::size_t>(others_)),
      pivots_(columns_.size()) {
  const Quaternion none = Quaternion::Identity();
  for (int ball : turning_balls) turning_.push_back({ball, none, none});
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
  turn_to_reference(x);
  double* const others = x + positions_;
  for (int k = 0; k < positions_; ++k) subtract(others_, x[k], columns[k] + positions_, others);
  solve_lu(columns_.data(), factored_, pivots_.data(), others);
  for (int i = factored_; i < others_; ++i)
    for (int j = 0; j < factored_; ++j) others[i] -= columns_[j][i] * others[j];
  for (int k = 0; k < positions_; ++k) x[k] -= columns[layout_.qd[k]][k] * x[layout_.qd[k]];
  turn_to_present(x);
}

void NewtonMatrix::keep(const double* y, Quaternion TurningBall::*orientation) {
  for (TurningBall& turning : turning_) {
    const double* q = layout_.quaternion.of(y, turning.ball);
    turning.*orientation = Quaternion(q[0], q[1], q[2], q[3]).normalized();
  }
}

void NewtonMatrix::turn_to_reference(double* x) const {
  for (const TurningBall& turning : turning_)
    turn(turning.ball, turning.reference.conjugate() * turning.present, x);
}

void NewtonMatrix::turn_to_present(double* x) const {
  for (const TurningBall& turning : turning_)
    turn(turning.ball, turning.present.conjugate() * turning.reference, x);
}

// A change of the orientation by a small rotation in the parent's axes is p * orientation / 2, with p its
// vector: the orientation is exchanged from the right.
void NewtonMatrix::turn(int ball, const Quaternion& rotation, double* x) const {
  double* q = layout_.quaternion.of(x, ball);
  const Quaternion turned = Quaternion(q[0], q[1], q[2], q[3]) * rotation.conjugate();
  q[0] = turned.w();
  Eigen::Map<Vec3<double>>(q + 1) = turned.vec();
  Eigen::Map<Vec3<double>> omega(layout_.omega.of(x, ball));
  omega = rotation * Vec3<double>(omega);
}

}  // namespace redysim
