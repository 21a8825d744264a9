#include "dynamics/assembly.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/bias.hpp"
#include "dynamics/loop_rows.hpp"
#include "math/least_norm.hpp"
#include "model/loop_rows_of.hpp"
#include "model/number.hpp"

namespace redysim {

namespace {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

// All relative to the size of the mechanism, or rad.
constexpr double closed_already = 2e-15;  // rounding: such a pose is left as it is
constexpr double closed_enough = 1e-10;
constexpr double dependent = 1e-8;  // rows of J below this part of the largest pivot
constexpr double smallest_damping = 1e-10;
constexpr double near_enough = 1e-9;  // of the nearest pose
constexpr double velocity_rounding = 1e-9;
constexpr double typed_precision = 1e-9;  // rad or m: below this start values and closed ones are the same

// One cluster: its joints' unknowns and its rows, both scaled to the cluster's size.
class ClusterAssembly {
 public:
  ClusterAssembly(const Model& model, const Plan<double>& plan, Workspace<double>& ws,
                  const ClusterPlan& cluster)
      : plan_(plan), ws_(ws), cluster_(cluster) {
    column_.assign(plan.joints.size(), -1);
    // descending in the plan: turn round, parents first
    for (auto joint = cluster.joints.rbegin(); joint != cluster.joints.rend(); ++joint) {
      joints_.push_back(*joint);
      if (model.links[plan.joints[*joint].link].joint.hold || plan.joints[*joint].prescribed) continue;
      column_[*joint] = static_cast<int>(free_.size());
      free_.push_back(*joint);
    }
    phi_.resize(cluster.row_count);
    rate_.resize(cluster.row_count);
    J_.resize(cluster.row_count, static_cast<Eigen::Index>(free_.size()));
  }

  // Takes the start pose, measures the mechanism and returns what is open.
  double start(const double* q) {
    for (int i : joints_) set_joint_position(plan_.joints[i], q[i], ws_.joints[i]);
    set_poses();
    const Vec3<double> root = ground_state(ws_, cluster_.root).position;
    for (int i : joints_) size_ = std::max(size_, (ws_.ground[i].position - root).norm());
    for (int k = 0; k < cluster_.loop_count; ++k) {
      const LoopGeometry<double> g = loop_geometry(loop(k), ws_);
      size_ = std::max({size_, (g.point_a.position - root).norm(), (g.point_b.position - root).norm()});
    }
    if (size_ == 0) size_ = 1;
    z_start_.resize(static_cast<Eigen::Index>(free_.size()));
    for (std::size_t j = 0; j < free_.size(); ++j) z_start_[j] = q[free_[j]] / unit(free_[j]);
    return open(z_start_);
  }

  const Vector& z_start() const { return z_start_; }
  const std::vector<int>& free_joints() const { return free_; }
  double unit(int joint) const { return plan_.joints[joint].prismatic ? size_ : 1.0; }

  // Levenberg-Marquardt steps, damped by the distance itself: quadratic at regular poses, steady at singular
  // ones. Returns what stays open.
  double close(Vector& z) {
    double norm = open(z);
    double damping_factor = 1;
    int idle = 0;
    for (int k = 0; k < 100 && norm > closed_already && idle < 3; ++k) {
      const double before = norm;
      set_jacobian();
      const LeastNorm tangent(J_, smallest_damping);
      const Vector wanted = -phi_;
      for (int attempt = 0; attempt < 8; ++attempt) {
        Vector step = tangent.solve(wanted, std::max(norm * damping_factor, smallest_damping));
        const double length = step.norm();
        if (length > 1) step /= length;
        const Vector trial = z + step;
        const double there = open(trial);
        if (there < norm) {
          z = trial;
          norm = there;
          damping_factor = std::max(0.25 * damping_factor, 1e-3);
          break;
        }
        if (norm < 1e-13) break;
        damping_factor *= 4;
      }
      idle = norm < (1 - 1e-5) * before ? 0 : idle + 1;
      if (norm == before) break;
    }
    open(z);
    return norm;
  }

  // From a closed pose along the loops to the one nearest to the start.
  void approach(Vector& z) {
    double distance = (z - z_start_).norm();
    for (int k = 0; k < 60; ++k) {
      open(z);
      set_jacobian();
      const Vector away = z_start_ - z;
      const Vector along = away - LeastNorm(J_, dependent).solve(opened_by(away));
      if (along.norm() < near_enough * std::max(1.0, distance)) break;
      bool nearer = false;
      for (double part = 1; part > 0.01 && !nearer; part *= 0.5) {
        Vector trial = z + part * along;
        if (close(trial) > closed_enough) continue;
        const double there = (trial - z_start_).norm();
        nearer = there < distance * (1 - 1e-12);
        if (nearer) {
          z = trial;
          distance = there;
        }
      }
      if (!nearer) break;
    }
    open(z);
  }

  // The nearest velocities on the loops; returns what held joints leave open.
  double align(const double* qd, std::vector<double>& change) {
    set_rates(qd);
    const double largest = rate_.lpNorm<Eigen::Infinity>();
    if (largest == 0 || free_.empty()) return largest;
    set_jacobian();
    const Vector step = LeastNorm(J_, dependent).solve(-rate_);
    for (std::size_t j = 0; j < free_.size(); ++j) change[free_[j]] = step[j] * unit(free_[j]);
    return (rate_ + opened_by(step)).lpNorm<Eigen::Infinity>() * size_;
  }

  // Gap of a loop of the cluster at the last pose, m or rad; whether it is mainly an angle.
  double gap(int k, bool& in_angle) const {
    double distance = 0, angle = 0;
    for (std::size_t r = 0; r < loop(k).rows.size(); ++r) {
      const double value = phi_[loop(k).first_row - cluster_.first_row + static_cast<int>(r)];
      (is_rotation(loop(k).rows[r]) ? angle : distance) += value * value;
    }
    in_angle = angle > distance;
    return std::sqrt(angle + size_ * size_ * distance);
  }

  const LoopPlan<double>& loop(int k) const { return plan_.loops[cluster_.first_loop + k]; }
  int loop_count() const { return cluster_.loop_count; }
  double size() const { return size_; }

  // Residuals at z; returns their norm.
  double open(const Vector& z) {
    for (std::size_t j = 0; j < free_.size(); ++j)
      set_joint_position(plan_.joints[free_[j]], z[j] * unit(free_[j]), ws_.joints[free_[j]]);
    set_poses();
    for (int k = 0; k < cluster_.loop_count; ++k) {
      const LoopGeometry<double> g = loop_geometry(loop(k), ws_);
      for (std::size_t r = 0; r < loop(k).rows.size(); ++r)
        phi_[local_row(k, r)] = row_values(g, loop(k).rows[r]).residual / row_unit(loop(k).rows[r]);
    }
    return phi_.norm();
  }

 private:
  static bool is_rotation(const ConstraintRow<double>& row) {
    return row.kind == ConstraintRow<double>::Kind::rotation;
  }
  double row_unit(const ConstraintRow<double>& row) const { return is_rotation(row) ? 1.0 : size_; }
  int local_row(int k, std::size_t r) const {
    return loop(k).first_row - cluster_.first_row + static_cast<int>(r);
  }
  // J x
  Vector opened_by(const Vector& x) const {
    Vector rates = Vector::Zero(J_.rows());
    for (Eigen::Index k = 0; k < J_.cols(); ++k) rates += x[k] * J_.col(k);
    return rates;
  }

  void set_poses() {
    for (int i : joints_)
      ws_.ground[i] = moved(plan_.joints[i], ws_.joints[i], ground_state(ws_, plan_.joints[i].parent), 0.0);
  }

  // The rows' wrenches, taken down both paths: J_rj = S_j . w.
  void set_jacobian() {
    J_.setZero();
    for (int k = 0; k < cluster_.loop_count; ++k) {
      const LoopGeometry<double> g = loop_geometry(loop(k), ws_);
      for (std::size_t r = 0; r < loop(k).rows.size(); ++r) {
        const RowValues<double> values = row_values(g, loop(k).rows[r]);
        const double scale = 1 / row_unit(loop(k).rows[r]);
        add_path(local_row(k, r), loop(k).body_a, values.on_a, scale);
        add_path(local_row(k, r), loop(k).body_b, values.on_b, scale);
      }
    }
  }

  void add_path(int row, int body, Force<double> w, double scale) {
    for (; body != cluster_.root; body = plan_.joints[body].parent) {
      const JointPlan<double>& joint = plan_.joints[body];
      if (column_[body] >= 0)
        J_(row, column_[body]) += scale * unit(body) * (joint.prismatic ? w.force.z() : w.moment.z());
      to_parent(joint, ws_.joints[body], w);
    }
  }

  void set_rates(const double* qd) {
    for (int i : joints_)
      ws_.ground[i] = moved(plan_.joints[i], ws_.joints[i], ground_state(ws_, plan_.joints[i].parent), qd[i]);
    for (int k = 0; k < cluster_.loop_count; ++k) {
      const LoopGeometry<double> g = loop_geometry(loop(k), ws_);
      for (std::size_t r = 0; r < loop(k).rows.size(); ++r)
        rate_[local_row(k, r)] = row_values(g, loop(k).rows[r]).rate / row_unit(loop(k).rows[r]);
    }
  }

  const Plan<double>& plan_;
  Workspace<double>& ws_;
  const ClusterPlan& cluster_;
  std::vector<int> joints_, free_;  // of the plan, parents first
  std::vector<int> column_;         // per joint of the plan: its unknown, or -1
  double size_ = 0;                 // m
  Vector z_start_, phi_, rate_;
  Matrix J_;
};

// Numbers in [-1, 1], the same in every run.
class Scatter {
 public:
  double next() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state_ >> 11) / 4503599627370496.0 - 1.0;
  }

 private:
  unsigned long long state_ = 1;
};

// Where no way leads downhill (a flat pose that must fold, say), starts around the given one: the nearest of
// the closed poses found at the smallest distance that has any.
double close_from_around(ClusterAssembly& cluster, Vector& z) {
  const Vector start = cluster.z_start();
  const int tries = std::clamp(200 / std::max(1, static_cast<int>(start.size())), 2, 8);
  Vector stuck = z, best;
  Scatter scatter;
  for (double spread : {0.01, 0.1, 0.5, 1.5, 3.0}) {
    for (int k = 0; k < tries; ++k) {
      Vector trial = start;
      for (Eigen::Index j = 0; j < trial.size(); ++j) trial[j] += spread * scatter.next();
      if (cluster.close(trial) > closed_enough) continue;
      if (best.size() == 0 || (trial - start).norm() < (best - start).norm()) best = trial;
    }
    if (best.size() > 0) break;
  }
  z = best.size() > 0 ? best : stuck;
  return cluster.open(z);
}

Pose link_pose(const Plan<double>& plan, const Workspace<double>& ws, int link, const double* qd) {
  if (link == ground) return Pose();
  const GroundState<double> body = body_motion(plan, ws, plan.carrier[link], qd);
  return Pose{body.rotation, body.position} * plan.frame_in_carrier[link];
}

// The equations that a planar scene leaves out hold in all poses or in none: a wrong axis or offset.
void check_left_out(const Model& model, const Plan<double>& plan, Workspace<double>& ws, const double* q,
                    Assembly& result) {
  const std::vector<double> at_rest(plan.joints.size(), 0.0);
  set_positions(plan, ws, q);
  for (std::size_t k = 0; k < model.loops.size(); ++k) {
    const std::vector<LoopRow> left_out = loop_rows_of(model, k).left_out;
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
    const double allowed = closed_enough * std::max({1.0, x_a.norm(), x_b.norm()});
    const double worst = std::max(distance, angle);
    if (worst <= std::max(allowed, result.closed ? 0 : result.gap)) continue;
    result.closed = false;
    result.loop = static_cast<int>(k);
    result.in_angle = angle > distance;
    result.gap = worst;
  }
}

std::string three_digits(double number) {
  if (number == 0) return "0";
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(number))) - 2);
  return rounded(std::round(number / unit) * unit);
}

// "joint2 by -0.262 rad, slider by 0.01 m": what changed by more than start values are typed with.
std::string changes(const Model& model, const Plan<double>& plan, const std::vector<double>& change,
                    const char* per) {
  std::string text;
  for (std::size_t i = 0; i < change.size(); ++i) {
    if (!(std::abs(change[i]) > typed_precision)) continue;
    const char* unit = plan.joints[i].prismatic ? " m" : " rad";
    text += (text.empty() ? "" : ", ") + model.links[plan.joints[i].link].joint.name + " by " +
            three_digits(change[i]) + unit + per;
  }
  return text;
}

}  // namespace

Assembly assemble(const Model& model, const Plan<double>& plan, Workspace<double>& ws, double* q,
                  double* qd) {
  Assembly result;
  if (!plan.has_loops()) return result;
  const std::vector<double> at_rest(plan.joints.size(), 0.0);
  set_positions(plan, ws, q);
  set_ground_motion(plan, ws, at_rest.data());
  std::vector<double> moved(plan.joints.size(), 0.0), sped(plan.joints.size(), 0.0);
  result.unit.assign(plan.joints.size(), 1.0);
  for (const ClusterPlan& plan_of_cluster : plan.clusters) {
    ClusterAssembly cluster(model, plan, ws, plan_of_cluster);
    double norm = cluster.start(q);
    for (int joint : plan_of_cluster.joints) result.unit[joint] = cluster.unit(joint);
    bool in_angle = false;
    for (int k = 0; k < cluster.loop_count(); ++k)
      result.gap_before = std::max(result.gap_before, cluster.gap(k, in_angle));
    Vector z = cluster.z_start();
    if (norm > closed_already && !cluster.free_joints().empty()) {
      norm = cluster.close(z);
      if (norm > closed_enough) norm = close_from_around(cluster, z);
      if (norm <= closed_enough) cluster.approach(z);
      norm = cluster.open(z);
      for (std::size_t j = 0; j < cluster.free_joints().size(); ++j) {
        const int joint = cluster.free_joints()[j];
        moved[joint] = (z[j] - cluster.z_start()[j]) * cluster.unit(joint);
      }
    }
    for (int k = 0; k < cluster.loop_count(); ++k) {
      const double gap = cluster.gap(k, in_angle);
      // an open loop is worse than a closed one
      const bool open = norm > closed_enough;
      if (open == !result.closed ? gap <= result.gap : !open) continue;
      result.closed = !open;
      result.gap = gap;
      result.in_angle = in_angle;
      if (open) result.loop = cluster.loop(k).loop;
    }
    const double rate = cluster.align(qd, sped);
    double fastest = 0;
    for (int joint : plan_of_cluster.joints) fastest = std::max(fastest, std::abs(qd[joint]));
    if (rate > velocity_rounding * std::max(1.0, fastest * cluster.size()) && rate > result.rate) {
      result.consistent = false;
      result.rate = rate;
      if (result.closed) result.loop = cluster.loop(0).loop;
    }
  }
  std::vector<double> closed_pose(q, q + plan.joints.size());
  for (std::size_t i = 0; i < moved.size(); ++i) closed_pose[i] += moved[i];
  check_left_out(model, plan, ws, closed_pose.data(), result);
  if (!result.closed || !result.consistent) return result;
  std::copy(closed_pose.begin(), closed_pose.end(), q);
  for (std::size_t i = 0; i < sped.size(); ++i) qd[i] += sped[i];
  result.moved = std::move(moved);
  result.sped = std::move(sped);
  return result;
}

std::string failure(const Model& model, const Assembly& assembly) {
  if (assembly.closed && assembly.consistent) return {};
  const std::string loop = "loop '" + model.loops[static_cast<std::size_t>(assembly.loop)].name + "' ";
  if (!assembly.closed)
    return loop + "cannot close: " + three_digits(assembly.gap) + (assembly.in_angle ? " rad" : " m") +
           " remain open at the nearest pose";
  return loop + "cannot keep the start velocities of the held joints: it would open at " +
         three_digits(assembly.rate) + " m/s";
}

std::string assembly_text(const Model& model, const Plan<double>& plan, const Assembly& assembly) {
  const std::string list = changes(model, plan, assembly.moved, "");
  if (list.empty()) return {};
  return "the start pose is open by " + three_digits(assembly.gap_before) + " m and assembles with " + list;
}

std::string changed_velocities(const Model& model, const Plan<double>& plan, const Assembly& assembly) {
  return changes(model, plan, assembly.sped, "/s");
}

}  // namespace redysim
