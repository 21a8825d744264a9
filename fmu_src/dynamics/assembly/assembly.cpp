#include "dynamics/assembly/assembly.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/assembly/cluster_assembly.hpp"
#include "dynamics/ball.hpp"
#include "dynamics/bias.hpp"
#include "model/loop_rows_of.hpp"

namespace redysim {

namespace {

using Vector = ClusterAssembly::Vector;
constexpr double rounding_residual = ClusterAssembly::rounding_residual,
                 accepted_residual = ClusterAssembly::accepted_residual,
                 rounded_data = ClusterAssembly::rounded_data;

// Pseudorandom numbers in [-1, 1], the same in each run.
class PseudoRandom {
 public:
  double next() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state_ >> 11) / 4503599627370496.0 - 1.0;
  }

 private:
  unsigned long long state_ = 1;
};

// Multi-start against local minima of the residual (for example a flat configuration that must fold): starts
// at increasing distances from the given configuration until some of one distance converge. The nearest of
// these solutions is used.
double minimize_from_nearby_starts(ClusterAssembly& cluster, Vector& z) {
  const Vector start = cluster.z_start();
  const int tries = std::clamp(200 / std::max(1, static_cast<int>(start.size())), 2, 8);
  Vector best;
  PseudoRandom random;
  for (double spread : {0.01, 0.1, 0.5, 1.5, 3.0}) {
    for (int k = 0; k < tries; ++k) {
      Vector trial = start;
      for (Eigen::Index j = 0; j < trial.size(); ++j) trial[j] += spread * random.next();
      if (cluster.minimize_residual(trial) > cluster.accepted()) continue;
      if (best.size() == 0 || (trial - start).norm() < (best - start).norm()) best = trial;
    }
    if (best.size() > 0) break;
  }
  if (best.size() > 0) z = best;
  return cluster.residual_norm(z);
}

Pose link_pose(const Plan<double>& plan, const Workspace<double>& ws, int link, const double* qd) {
  if (link == ground) return Pose();
  const GroundState<double> body = body_motion(plan, ws, plan.carrier[link], qd);
  return Pose{body.rotation, body.position} * plan.frame_in_carrier[link];
}

// Checks the constraints omitted in planar mechanisms. One configuration suffices: they hold in all
// configurations or in none (wrong axis or offset).
void check_omitted_rows(const Model& model, const Plan<double>& plan, Workspace<double>& ws, const double* q,
                        Assembly& result) {
  const std::vector<double> at_rest(plan.joints.size(), 0.0);
  set_positions(plan, ws, q);
  const std::vector<LoopRows> rows = loop_rows_of(model);
  for (std::size_t k = 0; k < model.loops.size(); ++k) {
    const std::vector<LoopRow>& left_out = rows[k].left_out;
    if (left_out.empty()) continue;
    const Loop& loop = model.loops[k];
    const Pose a = link_pose(plan, ws, loop.link_a, at_rest.data());
    const Pose b = link_pose(plan, ws, loop.link_b, at_rest.data());
    const Vec3<double> x_a = a.rotation * loop.point_a + a.position,
                       x_b = b.rotation * loop.point_b + b.position;
    double distance = 0, angle = 0;
    for (const LoopRow& row : left_out) {
      const Vec3<double> u = a.rotation * row.u;
      if (row.rotation)
        angle = std::hypot(angle, u.dot(b.rotation * row.v));
      else
        distance = std::hypot(distance, u.dot(x_b - x_a));
    }
    const double size = std::max({1.0, x_a.norm(), x_b.norm()}), worst = std::max(distance, angle);
    if (worst <= std::max(accepted_residual * size, result.closed ? 0 : result.gap.size)) continue;
    result.closed = false;
    result.nearly_closed = worst < rounded_data * size;
    result.constraint = static_cast<int>(k);
    result.gap = {worst, angle > distance};
  }
}

// Orientation and angular velocity of a spherical joint.
struct BallMotion {
  Mat3<double> rotation;
  Vec3<double> omega;

  BallMotion(int chart, const double* q, const double* qd) {
    const BallAngles angles{q[chart] != 0, q[chart + 1], q[chart + 2], q[chart + 3]};
    rotation = rotation_of(angles);
    omega = rate_matrix(angles) * Vec3<double>(qd[chart + 1], qd[chart + 2], qd[chart + 3]);
  }
};

double angle_between(const Mat3<double>& a, const Mat3<double>& b) {
  const Mat3<double> R = a.transpose() * b;
  const Vec3<double> twice_sine(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  return std::atan2(twice_sine.norm(), R.trace() - 1);
}

// Applies the corrections to q and qd and stores them per joint.
void apply(const Plan<double>& plan, const std::vector<double>& moved, const std::vector<double>& sped,
           double* q, double* qd, Assembly& result) {
  std::vector<BallMotion> before;
  for (const int chart : plan.balls) before.emplace_back(chart, q, qd);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    q[i] += moved[i];
    qd[i] += sped[i];
  }
  for (std::size_t k = 0; k < before.size(); ++k) {
    const BallMotion after(plan.balls[k], q, qd);
    result.ball_moved.push_back(angle_between(before[k].rotation, after.rotation));
    result.ball_sped.push_back((after.omega - before[k].omega).norm());
  }
  result.moved = moved;
  result.sped = sped;
}

void keep_larger(const Assembly::Residual& found, Assembly::Residual& largest) {
  if (found.size > largest.size) largest = found;
}

// Moves from the start values to the nearest configuration that satisfies the loops, otherwise to one with a
// minimum residual. Returns the norm of the residuals.
double solve_positions(ClusterAssembly& cluster, std::vector<double>& moved) {
  Vector z = cluster.z_start();
  double norm = cluster.minimize_residual(z);
  if (norm > cluster.accepted()) norm = minimize_from_nearby_starts(cluster, z);
  if (norm <= cluster.accepted()) cluster.move_to_nearest(z);
  norm = cluster.residual_norm(z);
  for (std::size_t j = 0; j < cluster.free_joints().size(); ++j) {
    const int joint = cluster.free_joints()[j];
    moved[joint] = (z[j] - cluster.z_start()[j]) * cluster.unit(joint);
  }
  return norm;
}

// Assembles the positions of a cluster.
void assemble_positions(ClusterAssembly& cluster, const double* q, std::vector<double>& moved,
                        Assembly& result) {
  double norm = cluster.start(q);
  for (int joint : cluster.joints()) result.unit[joint] = cluster.unit(joint);
  for (int k = 0; k < cluster.constraint_count(); ++k) keep_larger(cluster.gap(k), result.gap_before);
  if (norm > rounding_residual && !cluster.free_joints().empty()) norm = solve_positions(cluster, moved);
  const bool violated = norm > cluster.accepted();
  for (int k = 0; k < cluster.constraint_count(); ++k) {
    const Assembly::Residual gap = cluster.gap(k);
    // violated loops take precedence over satisfied ones
    if (violated == !result.closed ? gap.size <= result.gap.size : !violated) continue;
    result.closed = !violated;
    result.gap = gap;
    result.nearly_closed = violated && norm < rounded_data;
    if (violated) result.constraint = cluster.constraint(k);
  }
}

// Assembles the velocities of a cluster in its assembled configuration.
void assemble_velocities(ClusterAssembly& cluster, const double* qd, std::vector<double>& sped,
                         Assembly& result) {
  cluster.set_motion(qd);
  for (int k = 0; k < cluster.constraint_count(); ++k) keep_larger(cluster.rate(k), result.rate_before);
  cluster.correct_velocities(qd, sped);
  std::vector<double> velocity(qd, qd + sped.size());
  for (std::size_t i = 0; i < sped.size(); ++i) velocity[i] += sped[i];
  cluster.set_motion(velocity.data());
  for (int k = 0; k < cluster.constraint_count(); ++k) {
    if (cluster.constraint_rates_vanish(k, velocity.data()) ||
        (!result.consistent && cluster.rate(k).size <= result.rate.size))
      continue;
    result.consistent = false;
    result.rate = cluster.rate(k);
    if (result.closed) result.constraint = cluster.constraint(k);
  }
}

}  // namespace

Assembly assemble(const Model& model, const Plan<double>& plan, Workspace<double>& ws, double* q,
                  double* qd) {
  Assembly result;
  if (!plan.has_constraints()) return result;
  const std::vector<double> at_rest(plan.joints.size(), 0.0);
  set_positions(plan, ws, q);
  set_ground_motion(plan, ws, at_rest.data());
  std::vector<double> moved(plan.joints.size(), 0.0), sped(plan.joints.size(), 0.0);
  result.unit.assign(plan.joints.size(), 1.0);
  for (const ClusterPlan& cluster_plan : plan.clusters) {
    ClusterAssembly cluster(model, plan, ws, cluster_plan);
    assemble_positions(cluster, q, moved, result);
    assemble_velocities(cluster, qd, sped, result);
  }
  std::vector<double> assembled(q, q + plan.joints.size());
  for (std::size_t i = 0; i < moved.size(); ++i) assembled[i] += moved[i];
  check_omitted_rows(model, plan, ws, assembled.data(), result);
  if (result.closed && result.consistent) apply(plan, moved, sped, q, qd, result);
  return result;
}

}  // namespace redysim
