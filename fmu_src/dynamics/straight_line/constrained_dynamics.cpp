#include "dynamics/straight_line/constrained_dynamics.hpp"

#include <utility>

#include "dynamics/elastic_coupling.hpp"
#include "dynamics/loops/loop_rows.hpp"

namespace redysim {
namespace {

// Minimum part of a row that others do not explain, relative to its maximum at any configuration (squares in
// the mass metric). At this value multipliers lose four digits.
constexpr double smallest_pivot = 1e-4;

// Square of a magnitude: distances in m, speeds in m/s, spins in rad/s.
struct SquaredSizes {
  Recorded distance, speed, spin;

  void include(const GroundState<Recorded>& body) {
    distance += body.position.squaredNorm();
    speed += body.velocity.squaredNorm();
    spin += body.omega.squaredNorm();
  }
};

// As loop_magnitudes, with Euclidean norms.
SquaredSizes squared_sizes(const Plan<Recorded>& plan, const Workspace<Recorded>& ws,
                           const LoopPlan<Recorded>& loop) {
  SquaredSizes size;
  if (loop.root != ground) size.include(ground_state(ws, loop.entry_root));
  for (int body : {loop.body_a, loop.body_b})
    for (; body != loop.root; body = plan.joints[body].parent) size.include(ws.ground[body]);
  const Recorded arms = loop.point_a.squaredNorm() + loop.point_b.squaredNorm();
  size.distance += arms;
  size.speed += size.spin * arms;
  return size;
}

// phi'' of a row by the acceleration of a body at qdd = 0.
Recorded effect(const Force<Recorded>& wrench, const TreeEquations& tree, int body,
                const Plan<Recorded>& plan) {
  if (body == ground) return -wrench.force.dot(plan.gravity);
  const BodyAcceleration& a = tree.at_rest[static_cast<std::size_t>(body)];
  return wrench.moment.dot(a.angular) + wrench.force.dot(a.linear);
}

}  // namespace

JointRows::JointRows(const Plan<Recorded>& plan, Workspace<Recorded>& ws, const TreeEquations& tree,
                     const Recorded* q, const Recorded* qd, const Recorded* inputs)
    : J(RecordedMatrix::Zero(static_cast<int>(ws.loop.b.size()), plan.nv)),
      squared_bound(J),
      at_rest(ws.loop.b.size()),
      residual(at_rest),
      rate(at_rest),
      residual_size(at_rest),
      rate_size(at_rest) {
  set_ground_motion(plan, ws, qd);
  for (const auto& loop : plan.loops) set_loop(plan, ws, tree, loop);
  for (const auto& coupling : plan.couplings) set_coupling(plan, coupling, q, qd, inputs);
}

void JointRows::set_loop(const Plan<Recorded>& plan, const Workspace<Recorded>& ws, const TreeEquations& tree,
                         const LoopPlan<Recorded>& loop) {
  const LoopGeometry<Recorded> geometry = loop_geometry(loop, ws);
  const SquaredSizes size = squared_sizes(plan, ws, loop);
  for (std::size_t k = 0; k < loop.rows.size(); ++k) {
    const std::size_t row = static_cast<std::size_t>(loop.first_row) + k;
    const RowValues<Recorded> values = row_values(geometry, loop.rows[k]);
    const bool turns = loop.rows[k].kind == ConstraintRow<Recorded>::Kind::rotation;
    residual[row] = values.residual;
    rate[row] = values.rate;
    residual_size[row] = turns ? Recorded(1) : sqrt(size.distance);
    rate_size[row] = sqrt(turns ? size.spin : size.speed);
    const Force<Recorded> on_carrier{values.carrier_moment, Vec3<Recorded>::Zero()};
    at_rest[row] = values.quadratic + effect(values.on_a, tree, loop.body_a, plan) +
                   effect(values.on_b, tree, loop.body_b, plan) + effect(on_carrier, tree, loop.root, plan);
    add_levers(plan, ws, static_cast<int>(row), values.on_a, loop.point_a, loop.body_a, loop.root);
    add_levers(plan, ws, static_cast<int>(row), values.on_b, loop.point_b, loop.body_b, loop.root);
  }
}

// Adds the levers of a wrench on `body`, at a point of it, to a row of J.
void JointRows::add_levers(const Plan<Recorded>& plan, const Workspace<Recorded>& ws, int row,
                           Force<Recorded> wrench, const Vec3<Recorded>& point, int body, int root) {
  const bool is_moment = wrench.force.squaredNorm().is_zero();
  Recorded length = sqrt(point.squaredNorm());
  for (; body != root; body = plan.joints[body].parent) {
    const JointPlan<Recorded>& joint = plan.joints[body];
    J(row, body) += generalized_force(joint, wrench);
    squared_bound(row, body) += is_moment ? largest_squared(joint, Recorded(1), Recorded(0))
                                          : largest_squared(joint, length * length, Recorded(1));
    Mat3<Recorded> rotation;
    Vec3<Recorded> position;
    joint_pose(joint, ws.joints[body], rotation, position);
    length += sqrt(position.squaredNorm());
    to_parent(joint, ws.joints[body], wrench);
  }
}

void JointRows::set_coupling(const Plan<Recorded>& plan, const CouplingPlan& coupling, const Recorded* q,
                             const Recorded* qd, const Recorded* inputs) {
  const std::size_t row = static_cast<std::size_t>(coupling.row);
  residual[row] = coupling_sum(coupling, q, coupling.offset);
  rate[row] = coupling_sum(coupling, qd, 0.0);
  Recorded distance, speed;
  for (std::size_t k = 0; k < coupling.joints.size(); ++k) {
    const int joint = coupling.joints[k];
    const double ratio = coupling.ratios[k], unit = ratio * plan.joint_units[joint];
    J(coupling.row, joint) = ratio;
    squared_bound(coupling.row, joint) = ratio * ratio;
    if (plan.joints[joint].prescribed) at_rest[row] += ratio * inputs[joint];
    distance += ratio * ratio * q[joint] * q[joint] + unit * unit;
    speed += ratio * ratio * qd[joint] * qd[joint];
  }
  residual_size[row] = sqrt(distance);
  rate_size[row] = sqrt(speed);
}

JointRowFactor::JointRowFactor(const TreeEquations& tree, const JointRows& rows) : tree_(tree), rows_(rows) {
  for (int row = 0; row < rows.J.rows(); ++row) {
    if (!has_effect(row)) continue;
    effective_.push_back(row);
    lever_.emplace_back(rows.J.row(row).begin(), rows.J.row(row).end());
    tree.factor.eliminate(lever_.back().data());
  }
  factorize();
}

bool JointRowFactor::has_effect(int row) const {
  for (int joint = 0; joint < rows_.J.cols(); ++joint)
    if (!rows_.J(row, joint).is_zero() && !tree_.factor.inverse_pivot(joint).is_zero()) return true;
  return false;
}

void JointRowFactor::factorize() {
  const int count = static_cast<int>(lever_.size()), joints = static_cast<int>(rows_.J.cols());
  L_ = RecordedMatrix::Zero(count, count);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j <= i; ++j)
      for (int k = 0; k < joints; ++k)
        L_(i, j) += lever_[i][k] * tree_.factor.inverse_pivot(k) * lever_[j][k];
    // the entries of row i before j are L D, those after it are S
    for (int j = 0; j < i; ++j)
      for (int k = 0; k < j; ++k) L_(i, j) -= L_(i, k) * L_(j, k);
    for (int j = 0; j < i; ++j) {
      const Recorded scaled = L_(i, j) * L_(j, j);
      L_(i, i) -= scaled * L_(i, j);
      L_(i, j) = scaled;
    }
    Recorded largest;
    for (int k = 0; k < joints; ++k)
      largest += rows_.squared_bound(effective_[i], k) * tree_.factor.inverse_pivot(k);
    margins_.push_back(L_(i, i) - Recorded(smallest_pivot) * largest);
    L_(i, i) = Recorded(1) / L_(i, i);
  }
}

std::vector<Recorded> JointRowFactor::solved(std::vector<Recorded> b) const {
  const int count = static_cast<int>(b.size());
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < i; ++j) b[i] -= L_(i, j) * b[j];
  for (int i = 0; i < count; ++i) b[i] *= L_(i, i);
  for (int i = count - 1; i >= 0; --i)
    for (int j = i + 1; j < count; ++j) b[i] -= L_(j, i) * b[j];
  return b;
}

JointRowFactor::Motion JointRowFactor::response(std::vector<Recorded> forces, std::vector<Recorded> b) const {
  b = solved(std::move(b));
  for (std::size_t i = 0; i < lever_.size(); ++i)
    for (std::size_t k = 0; k < forces.size(); ++k) forces[k] += lever_[i][k] * b[i];
  tree_.factor.substitute(forces.data());
  return {std::move(forces), std::move(b)};
}

Recorded JointRowFactor::prescribed_force(const Motion& motion, int i) const {
  Recorded force = tree_.bias[static_cast<std::size_t>(i)];
  for (std::size_t k = 0; k < motion.qdd.size(); ++k)
    force += tree_.M(i, static_cast<int>(k)) * motion.qdd[k];
  for (std::size_t k = 0; k < effective_.size(); ++k) force -= rows_.J(effective_[k], i) * motion.lambda[k];
  return force;
}

JointRowFactor::Motion JointRowFactor::motion(const Recorded* tau) const {
  std::vector<Recorded> forces(tree_.bias), b(lever_.size());
  for (std::size_t k = 0; k < forces.size(); ++k) forces[k] = tau[k] - forces[k];
  tree_.factor.eliminate(forces.data());
  for (std::size_t i = 0; i < lever_.size(); ++i) {
    b[i] = -rows_.at_rest[static_cast<std::size_t>(effective_[i])];
    for (std::size_t k = 0; k < forces.size(); ++k)
      b[i] -= lever_[i][k] * tree_.factor.inverse_pivot(static_cast<int>(k)) * forces[k];
  }
  return response(std::move(forces), std::move(b));
}

RecordedMatrix JointRowFactor::corrections() const {
  RecordedMatrix C = RecordedMatrix::Zero(rows_.J.cols(), rows_.J.rows());
  for (std::size_t column = 0; column < lever_.size(); ++column) {
    std::vector<Recorded> b(lever_.size()), forces(static_cast<std::size_t>(C.rows()));
    b[column] = 1;
    forces = response(std::move(forces), std::move(b)).qdd;
    for (std::size_t k = 0; k < forces.size(); ++k) C(static_cast<int>(k), effective_[column]) = forces[k];
  }
  return C;
}

}  // namespace redysim
