#include "integrate/system/independent_coordinates.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "dynamics/assembly/assembly.hpp"
#include "dynamics/assembly/freedom.hpp"
#include "dynamics/ball.hpp"
#include "dynamics/compiled.hpp"
#include "integrate/system/start.hpp"
#include "math/complete_pivoting.hpp"

namespace redysim {
namespace {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

// Residuals relative to the size of the mechanism, or in rad.
constexpr double near_start = 1e-6;  // maximum for ranks of the assembled configuration
constexpr double closed = 1e-8;
// Of corrections, in units of the joints: larger ones may lead to another branch, safe ones do not, nor those
// that are small compared with the predicted motion. These may cross a singular configuration.
constexpr double longest_correction = 0.1, safe_correction = 1e-4, predicted_part = 0.05;
constexpr double failed = std::numeric_limits<double>::infinity();
constexpr double shortest_share = 1.0 / 512;  // minimum part of the path to a configuration

// Moves y to a nearby state, the same in each run.
void disturb(const System& system, int attempt, std::vector<double>& y) {
  const StateLayout& layout = system.layout();
  const auto some = [attempt](int k) { return 0.03 * std::sin(1.0 + 2.0 * k + 5.0 * attempt); };
  for (int k = 0; k < system.simple(); ++k) y[k] += some(k) * system.scales()[k];
  for (int k = layout.quaternion.begin; k < layout.quaternion.end(); ++k) y[k] += some(k);
}

}  // namespace

std::vector<int> independent_joints(const Model& model, const Parameters<double>& parameters,
                                    System& system) {
  const Plan<double>& plan = system.plan();
  if (!plan.has_constraints()) return {};
  begin_motions(model, system, 0);
  std::vector<double> y(static_cast<std::size_t>(system.size()));
  set_start_values(parameters, system, y.data());
  const auto ranks_at = [&](const std::vector<double>& state, double smallest) {
    return constraint_ranks(model, plan, system.coordinates(0, state.data()).q, FreeJoints::integrated,
                            smallest);
  };
  ConstraintRanks found = ranks_at(y, 1e-3);
  if (!(found.gap < near_start) || !found.are_full) {
    // redundant rows are dependent only if the loops are closed, other rows at singular configurations
    const System::Coordinates at = system.coordinates(0, y.data());
    std::vector<double> q(at.q, at.q + plan.nv), qd(at.qd, at.qd + plan.nv);
    const Assembly assembly = assemble(model, plan, system.workspace(), q.data(), qd.data());
    if (!assembly.moved.empty()) system.collect(q.data(), qd.data(), y.data());
    found = ranks_at(y, 1e-7);
    for (int attempt = 0; attempt < 3 && assembly.closed && !found.are_full; ++attempt) {
      std::vector<double> nearby = y;
      disturb(system, attempt, nearby);
      if (!system.close_loops(0, nearby.data())) continue;
      const std::vector<int> there = ranks_at(nearby, 1e-6).ranks;
      for (std::size_t k = 0; k < there.size(); ++k) found.ranks[k] = std::max(found.ranks[k], there[k]);
    }
  }
  std::vector<int> counts = found.joints;
  for (std::size_t k = 0; k < counts.size(); ++k) counts[k] -= found.ranks[k];
  return counts;
}

IndependentCoordinates::IndependentCoordinates(const Model& model, System& system,
                                               const std::vector<int>& counts)
    : system_(system),
      workspace_(system.plan()),
      turned_(static_cast<std::size_t>(system.balls())),
      in_cluster_(static_cast<std::size_t>(system.plan().nv)),
      q_(in_cluster_.size()),
      qd_(q_),
      y_(static_cast<std::size_t>(system.size())) {
  const Plan<double>& plan = system.plan();
  int first = 0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    clusters_.emplace_back(new Cluster{
        {model, plan, workspace_, plan.clusters[k], FreeJoints::integrated}, first, counts[k], {}, {}});
    for (int joint : clusters_.back()->rows.joints())
      if (plan.joints[joint].prescribed && !plan.joints[joint].of_ball)
        clusters_.back()->driven.push_back(joint);
    for (int joint : clusters_.back()->rows.free_joints()) in_cluster_[static_cast<std::size_t>(joint)] = 1;
    first += counts[k];
  }
  entries_.resize(static_cast<std::size_t>(first));
  const StateLayout& layout = system.layout();
  std::vector<char> depends(y_.size());
  for (int k = 0; k < system.simple(); ++k)
    depends[layout.q[k]] = depends[layout.qd[k]] = in_cluster_[system.joint_of(k)];
  for (int ball = 0; ball < system.balls(); ++ball) {
    std::fill_n(&depends[layout.quaternion[ball]], 4, is_in_cluster(ball));
    std::fill_n(&depends[layout.omega[ball]], 3, is_in_cluster(ball));
  }
  for (std::size_t i = 0; i < depends.size(); ++i)
    (depends[i] ? dependent_ : kept_).push_back(static_cast<int>(i));
}

IndependentCoordinates::Entry IndependentCoordinates::entry(int joint) const {
  Entry entry;
  entry.joint = joint;
  for (int ball = 0; ball < system_.balls(); ++ball)
    if (const int axis = joint - system_.plan().balls[ball] - 1; 0 <= axis && axis < 3) {
      entry.ball = ball;
      entry.axis = axis;
    }
  while (entry.ball < 0 && system_.joint_of(entry.place) != joint) ++entry.place;
  return entry;
}

int IndependentCoordinates::rank() const {
  int rank = 0;
  for (const auto& cluster : clusters_) rank += cluster->rank();
  return rank;
}

void IndependentCoordinates::nominals(double* states) const {
  std::vector<double> of_y(y_.size());
  system_.nominals(of_y.data());
  for (int i : kept_) *states++ = of_y[i];
  for (int k = 0; k < count(); ++k)
    states[k] = states[count() + k] = entries_[k].ball < 0 ? system_.scales()[entries_[k].place] : 1;
}

IndependentCoordinates::BallMotion IndependentCoordinates::motion_of(int ball, const double* y) const {
  BallMotion motion;
  motion.angles = angles_in_chart(rotation_of(system_.layout().quaternion.of(y, ball)), turned_[ball] != 0);
  motion.rates = angle_rates(motion.angles, Vec3<double>(system_.layout().omega.of(y, ball)));
  return motion;
}

// Sets q_ and qd_ of all joints, in clusters in the fixed charts, and the constraint rows of the clusters.
void IndependentCoordinates::expand(double time, const double* y) {
  const System::Coordinates at = system_.coordinates(time, y);
  std::copy_n(at.q, q_.size(), q_.begin());
  std::copy_n(at.qd, qd_.size(), qd_.begin());
  for (int ball = 0; ball < system_.balls(); ++ball) {
    if (!is_in_cluster(ball)) continue;
    const int chart = system_.plan().balls[ball];
    const auto [angles, rates] = motion_of(ball, y);
    std::copy_n(joint_positions(angles).begin(), 4, &q_[chart]);
    std::copy_n(rates.data(), 3, &qd_[chart + 1]);
  }
  compiled_ground_motion(system_.plan(), workspace_, q_.data(), qd_.data());
  for (const auto& of : clusters_) {
    of->rows.set_pose(q_.data());
    of->rows.measure();
    of->rows.set_motion(qd_.data());
  }
}

void IndependentCoordinates::choose(double time, const double* y) {
  for (int ball = 0; ball < system_.balls(); ++ball)
    turned_[ball] = ball_angles(rotation_of(system_.layout().quaternion.of(y, ball))).turned;
  expand(time, y);
  std::vector<char> independent(in_cluster_.size());
  for (const auto& of : clusters_) {
    Cluster& cluster = *of;
    const ClusterRows<double>& rows = cluster.rows;
    const CompletePivoting factor(rows.jacobian(), cluster.rank(), 0, rows.jacobian().cols());
    for (int k = 0; k < cluster.count; ++k)
      independent[rows.free_joints()[factor.columns()[cluster.rank() + k]]] = 1;
  }
  take(independent);
}

void IndependentCoordinates::take(const std::vector<char>& independent) {
  auto next = entries_.begin();
  for (const auto& of : clusters_) {
    Cluster& cluster = *of;
    cluster.dependent.clear();
    for (int joint : cluster.rows.free_joints())
      if (independent[joint])
        *next++ = entry(joint);
      else
        cluster.dependent.push_back(joint);
  }
}

double IndependentCoordinates::leverage(double time, const double* y) {
  if (clusters_.empty()) return 0;
  double largest = 0;
  for (int ball = 0; ball < system_.balls(); ++ball)
    if (is_in_cluster(ball))
      largest = std::max(largest, usual / 2 / std::cos(motion_of(ball, y).angles.theta));
  expand(time, y);
  for (const auto& of : clusters_) {
    std::vector<int> joints = of->dependent;
    for (int k = of->first; k < of->first + of->count; ++k) joints.push_back(entries_[k].joint);
    const Matrix J = of->rows.jacobian(joints);
    const double now = CompletePivoting(J, of->rank(), singular, of->rank()).leverage();
    if (now > largest &&
        (now <= usual || CompletePivoting(J, of->rank(), singular, J.cols()).leverage() < 0.5 * now))
      largest = now;
  }
  return largest;
}

IndependentCoordinates::Motion IndependentCoordinates::motion(int k, const double* y,
                                                              const double* ydot) const {
  const Entry& at = entries_[k];
  const StateLayout& layout = system_.layout();
  if (at.ball < 0)
    return {y[layout.q[at.place]], y[layout.qd[at.place]], ydot ? ydot[layout.qd[at.place]] : 0};
  const auto [angles, rates] = motion_of(at.ball, y);
  const double positions[] = {angles.phi, angles.theta, angles.psi};
  Motion result{positions[at.axis], rates[at.axis], 0};
  if (!ydot) return result;
  const Vec3<double> alpha(layout.omega.of(ydot, at.ball));
  result.qdd = angle_rates(angles, Vec3<double>(alpha - rate_bias(angles, rates)))[at.axis];
  return result;
}

IndependentCoordinates::Direction IndependentCoordinates::direction(int k, const double* y,
                                                                    const Tangent& tangent) const {
  const Entry& at = entries_[k];
  if (at.ball < 0) return {tangent.q[at.joint], tangent.qd[at.joint], tangent.qdd[at.joint]};
  const BallAngles angles = motion_of(at.ball, y).angles;
  const Tangent::BallMotion motion = tangent.ball(at.ball);
  const Vec3<double> change = angle_rates(angles, motion.turn);
  const BallAnglesOf<Dual> moved{angles.turned, Dual(angles.phi, change[0]), Dual(angles.theta, change[1]),
                                 Dual(angles.psi, change[2])};
  const Vec3<Dual> rates = angle_rates(moved, motion.omega);
  const Vec3<Dual> accelerations = angle_rates(moved, Vec3<Dual>(motion.alpha - rate_bias(moved, rates)));
  const Dual positions[] = {moved.phi, moved.theta, moved.psi};
  return {positions[at.axis], rates[at.axis], accelerations[at.axis]};
}

// Factor of the columns of the dependent joints, in the current pose.
CompletePivoting IndependentCoordinates::Cluster::factor() const {
  return {rows.jacobian(dependent), rank(), singular, rank()};
}

// Newton's iteration for the dependent joints. Returns the sum of the corrections.
double IndependentCoordinates::solve_positions(Cluster& cluster, std::vector<double>& q) {
  ClusterRows<double>& rows = cluster.rows;
  double before = failed, sum = 0;
  for (;;) {
    rows.set_pose(q.data());
    rows.set_rows();
    const double now = rows.residuals().lpNorm<Eigen::Infinity>();
    if (!(now > System::rounding && now < 0.5 * before)) return now <= closed ? sum : failed;
    before = now;
    const CompletePivoting factor = cluster.factor();
    const Vector change = factor.solve(rows.residuals());
    const double largest = change.lpNorm<Eigen::Infinity>();
    if (!(largest < longest_correction)) return failed;
    sum += largest;
    for (std::size_t k = 0; k < cluster.dependent.size(); ++k)
      q[cluster.dependent[k]] -= change[k] * rows.unit(cluster.dependent[k]);
  }
}

// Whether a singular configuration lies between the last point and q, or an odd number: det(A^-1 B) < 0 for
// the dependent columns A, there, and B.
bool IndependentCoordinates::crosses_singular(Cluster& cluster, const std::vector<double>& q) {
  const auto move_to = [&](const std::vector<double>& at) {
    cluster.rows.set_pose(at.data());
    cluster.rows.set_rows();
  };
  move_to(q_);
  const CompletePivoting A = cluster.factor();
  move_to(q);
  const Eigen::Index n = cluster.rank();
  if (A.rank() < n) return false;
  Matrix ratio = cluster.rows.jacobian(cluster.dependent);
  for (Eigen::Index j = 0; j < n; ++j) ratio.col(j).head(n) = A.solve(ratio.col(j));
  return CompletePivoting(ratio.topRows(n), n, 0, n).is_negative();
}

// Moves from the last point to the given positions of independent and prescribed joints, in several moves if
// one is too long. The velocities predict the dependent joints: where branches meet, they select the branch.
bool IndependentCoordinates::follow_positions(Cluster& cluster, const double* q, const double*& driven) {
  std::vector<Way> ways;
  for (int k = cluster.first; k < cluster.first + cluster.count; ++k) {
    const double from = q_[entries_[k].joint], length = q[k] - from;
    // angles of spherical joints are between -pi and pi
    const bool is_angle = entries_[k].ball >= 0;
    ways.push_back({entries_[k].joint, from, q[k], is_angle ? std::remainder(length, 4 * half_pi) : length});
    if (is_angle) ways.back().to = from + ways.back().length;
  }
  for (int joint : cluster.driven) {
    ways.push_back({joint, *driven, q_[joint], q_[joint] - *driven});
    ++driven;
  }
  double along = 0, squared = 0;
  for (const Way& way : ways) {
    along += qd_[way.joint] * way.length;
    squared += qd_[way.joint] * qd_[way.joint];
  }
  const double span = squared > 0 ? along / squared : 0;  // s
  const std::vector<double> start = q_;
  bool rejected = false;
  if (move(cluster, ways, span, &rejected)) return true;
  if (!rejected) return false;
  q_ = start;
  return move(cluster, ways, span, nullptr);
}

// Follows straight ways of the independent and prescribed joints, at constant velocities for `span` seconds.
// `rejected` is set if a move would cross a singular configuration; null: it may.
bool IndependentCoordinates::move(Cluster& cluster, const std::vector<Way>& ways, double span,
                                  bool* rejected) {
  double done = 0, share = 1;
  while (done < 1) {
    std::vector<double> trial = q_;
    double predicted = 0;
    for (int joint : cluster.dependent) {
      const double change = share * span * qd_[joint];
      trial[joint] += change;
      predicted = std::max(predicted, std::abs(change) / cluster.rows.unit(joint));
    }
    for (const Way& way : ways)
      trial[way.joint] = done + share < 1 ? way.from + (done + share) * way.length : way.to;
    const double correction = solve_positions(cluster, trial);
    const bool is_safe = correction < std::max(safe_correction, predicted_part * predicted),
               crosses = rejected && !is_safe && correction < failed && crosses_singular(cluster, trial);
    if (crosses) *rejected = true;
    if (correction < failed && !crosses) {
      q_.swap(trial);
      done += share;
      share = std::min(2 * share, 1 - done);
    } else {
      was_far_ = true;
      if ((share *= 0.5) < shortest_share) return false;
    }
  }
  return true;
}

// Velocities of the dependent joints; the second pass removes rounding errors.
bool IndependentCoordinates::solve_velocities(Cluster& cluster) {
  ClusterRows<double>& rows = cluster.rows;
  for (int pass = 0; pass < 2; ++pass) {
    rows.set_motion(qd_.data());
    const CompletePivoting factor = cluster.factor();
    const Vector change = factor.solve(rows.rates());
    for (std::size_t k = 0; k < cluster.dependent.size(); ++k)
      qd_[cluster.dependent[k]] -= change[k] * rows.unit(cluster.dependent[k]);
    if (!change.allFinite()) return false;
  }
  return true;
}

std::vector<double> IndependentCoordinates::driven(double time, const double* y) const {
  const System::Coordinates at = system_.coordinates(time, y);
  std::vector<double> positions;
  for (const auto& cluster : clusters_)
    for (int joint : cluster->driven) positions.push_back(at.q[joint]);
  return positions;
}

bool IndependentCoordinates::close(double time, const double* q, const double* qd,
                                   const std::vector<double>& driven, double* y) {
  expand(time, y);
  was_far_ = false;
  const double* next = driven.data();
  for (const auto& of : clusters_) {
    Cluster& cluster = *of;
    if (!follow_positions(cluster, q, next)) return false;
    for (int k = cluster.first; k < cluster.first + cluster.count; ++k) qd_[entries_[k].joint] = qd[k];
    if (!solve_velocities(cluster)) return false;
  }
  std::copy_n(y, y_.size(), y_.begin());
  system_.collect(q_.data(), qd_.data(), y_.data());
  for (int i : dependent_) y[i] = y_[i];
  return true;
}

void IndependentCoordinates::seed(const double* y, const double* dq, const double* dqd, std::vector<Dual>& q,
                                  std::vector<Dual>& qd) const {
  const Plan<double>& plan = system_.plan();
  for (int k = 0; k < system_.simple(); ++k) {
    const int joint = system_.joint_of(k);
    if (in_cluster_[joint]) q[joint].derivative = qd[joint].derivative = 0;
  }
  for (int ball = 0; ball < system_.balls(); ++ball) {
    if (!is_in_cluster(ball)) continue;
    const auto [angles, rates] = motion_of(ball, y);
    const std::array<double, 4> values = joint_positions(angles);
    for (int i = 0; i < 4; ++i) q[plan.balls[ball] + i] = Dual(values[i]);
    for (int i = 0; i < 3; ++i) qd[plan.balls[ball] + 1 + i] = Dual(rates[i]);
  }
  for (int k = 0; k < count(); ++k) {
    q[entries_[k].joint].derivative = dq[k];
    qd[entries_[k].joint].derivative = dqd[k];
  }
}

std::vector<double> IndependentCoordinates::choice() const {
  std::vector<double> choice(turned_.begin(), turned_.end());
  for (const Entry& entry : entries_) choice.push_back(entry.joint);
  return choice;
}

bool IndependentCoordinates::restore(const std::vector<double>& choice) {
  std::vector<char> independent(in_cluster_.size());
  const double* next = choice.data() + turned_.size();
  for (const auto& cluster : clusters_) {
    const double* const end = next + cluster->count;
    for (int joint : cluster->rows.free_joints())
      if (next != end && *next == joint) {
        independent[joint] = 1;
        ++next;
      }
    if (next != end) return false;
  }
  for (std::size_t ball = 0; ball < turned_.size(); ++ball) turned_[ball] = choice[ball] != 0;
  take(independent);
  return true;
}

}  // namespace redysim
