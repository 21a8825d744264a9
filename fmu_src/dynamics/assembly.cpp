#include "dynamics/assembly.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/bias.hpp"
#include "dynamics/cluster_assembly.hpp"
#include "model/loop_rows_of.hpp"
#include "model/number.hpp"

namespace redysim {

namespace {

using Vector = ClusterAssembly::Vector;
constexpr double closed_already = ClusterAssembly::closed_already,
                 closed_enough = ClusterAssembly::closed_enough;

constexpr double velocity_rounding = 1e-9;
constexpr double typed_precision = 1e-9;  // rad or m: below this start values and closed ones are the same

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
