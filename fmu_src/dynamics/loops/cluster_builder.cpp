#include "dynamics/loops/cluster_builder.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

#include "dynamics/loops/coupling_chains.hpp"
#include "dynamics/loops/coupling_crossings.hpp"
#include "dynamics/loops/front_builder.hpp"
#include "dynamics/loops/loop_sides.hpp"
#include "model/loop_rows_of.hpp"
#include "model/motion_scale.hpp"

namespace redysim {

namespace {

// The path of one loop or rigid coupling as joint indices.
struct LoopPath : LoopSides {  // up to the meeting body; descending for a coupling
  int loop = -1;               // index into Model::loops; -1: a coupling
  int coupling = -1;           // index into CouplingSystem::rows; -1: a loop
  int body_a = ground, body_b = ground;
  int meeting = ground;  // last common body; ground for rows with ground directions
};

class ClusterBuilder {
 public:
  ClusterBuilder(const Model& model, const std::vector<int>& parents, const std::vector<int>& carrier,
                 const std::vector<LoopRows>& rows, const CouplingSystem& couplings)
      : parents_(parents), couplings_(couplings) {
    for (std::size_t k = 0; k < model.loops.size(); ++k) paths_.push_back(path_of(model, carrier, rows, k));
    for (std::size_t k = 0; k < couplings.rows.size(); ++k) {
      paths_.push_back(coupling_path(couplings.rows[k]));
      paths_.back().coupling = static_cast<int>(k);
    }
    group();
  }

  // One cluster.
  struct Group {
    int root = ground;
    std::vector<int> joints;  // descending
    std::vector<int> paths;   // its loops and couplings, ordered for a narrow envelope of S
  };
  const std::vector<Group>& groups() const { return groups_; }
  const CoupledJoints& coupling_row(const LoopPath& path) const { return couplings_.rows[path.coupling]; }
  const LoopPath& path(int index) const { return paths_[index]; }

  // The joints between the meeting body of a loop and the root of its cluster.
  std::vector<int> shared_joints(const LoopPath& path, int root) const {
    std::vector<int> joints;
    for (int body = path.meeting; body != root; body = parents_[body]) joints.push_back(body);
    return joints;
  }

 private:
  LoopPath path_of(const Model& model, const std::vector<int>& carrier, const std::vector<LoopRows>& rows,
                   std::size_t k) const {
    const Loop& loop = model.loops[k];
    LoopPath path;
    path.loop = static_cast<int>(k);
    path.body_a = loop.link_a == ground ? ground : carrier[loop.link_a];
    path.body_b = loop.link_b == ground ? ground : carrier[loop.link_b];
    // parents have smaller indices: replace the larger one by its parent until both are equal
    int a = path.body_a, b = path.body_b;
    while (a != b) {
      int& outboard = a > b ? a : b;
      (a > b ? path.joints_a : path.joints_b).push_back(outboard);
      outboard = parents_[outboard];
    }
    path.meeting = a;
    if (rows[k].tied_to_ground)
      for (; path.meeting != ground; path.meeting = parents_[path.meeting]) {
        path.joints_a.push_back(path.meeting);
        path.joints_b.push_back(path.meeting);
      }
    return path;
  }

  // Path from the coupled joints to the deepest body inboard of all of them.
  LoopPath coupling_path(const CoupledJoints& row) const {
    LoopPath path;
    path.joints_a = row.joints;
    std::set<int, std::greater<int>> outer;  // bodies that are not yet the meeting body
    for (int joint : row.joints) outer.insert(parents_[joint]);
    while (outer.size() > 1) {
      const int body = *outer.begin();
      path.joints_a.push_back(body);
      outer.erase(body);
      outer.insert(parents_[body]);
    }
    path.meeting = *outer.begin();
    sort_joints(path.joints_a);
    return path;
  }

  static void sort_joints(std::vector<int>& joints) {
    std::sort(joints.begin(), joints.end(), std::greater<int>());
    joints.erase(std::unique(joints.begin(), joints.end()), joints.end());
  }

  // Loops that share a joint form a cluster (union-find over joints).
  void group() {
    std::vector<int> leader(parents_.size());
    std::iota(leader.begin(), leader.end(), 0);
    auto find = [&leader](int i) {
      while (leader[i] != i) i = leader[i] = leader[leader[i]];
      return i;
    };
    for (const LoopPath& path : paths_) {
      const int first = path.joints_a.empty() ? path.joints_b.front() : path.joints_a.front();
      for (int joint : path.joints_a) leader[find(joint)] = find(first);
      for (int joint : path.joints_b) leader[find(joint)] = find(first);
    }
    std::vector<int> group_of(parents_.size(), -1);
    for (std::size_t k = 0; k < paths_.size(); ++k) {
      const LoopPath& path = paths_[k];
      const int top = find(path.joints_a.empty() ? path.joints_b.front() : path.joints_a.front());
      if (group_of[top] < 0) {
        group_of[top] = static_cast<int>(groups_.size());
        groups_.emplace_back();
        groups_.back().root = path.meeting;
      }
      Group& group = groups_[group_of[top]];
      group.root = std::min(group.root, path.meeting);
      group.paths.push_back(static_cast<int>(k));
    }
    for (Group& group : groups_) {
      collect_joints(group);
      order_by_neighbourhood(group);
    }
  }

  void collect_joints(Group& group) const {
    for (int index : group.paths) {
      const LoopPath& path = paths_[index];
      group.joints.insert(group.joints.end(), path.joints_a.begin(), path.joints_a.end());
      group.joints.insert(group.joints.end(), path.joints_b.begin(), path.joints_b.end());
      const std::vector<int> shared = shared_joints(path, group.root);
      group.joints.insert(group.joints.end(), shared.begin(), shared.end());
    }
    sort_joints(group.joints);
  }

  // Breadth-first order from a loop of minimum degree (Cuthill and McKee 1969), for a narrow envelope of S.
  void order_by_neighbourhood(Group& group) const {
    const std::size_t n = group.paths.size();
    std::vector<std::vector<std::size_t>> neighbours(n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        if (i != j && paths_[group.paths[i]].is_coupled_to(paths_[group.paths[j]]))
          neighbours[i].push_back(j);
    auto fewer = [&neighbours](std::size_t i, std::size_t j) {
      return std::pair(neighbours[i].size(), i) < std::pair(neighbours[j].size(), j);
    };
    std::vector<std::size_t> order, seeds(n);
    std::vector<char> seen(n, 0);
    std::iota(seeds.begin(), seeds.end(), std::size_t{0});
    std::sort(seeds.begin(), seeds.end(), fewer);
    for (std::size_t seed : seeds) {
      if (seen[seed]) continue;
      seen[seed] = 1;
      order.push_back(seed);
      for (std::size_t at = order.size() - 1; at < order.size(); ++at) {
        std::vector<std::size_t> next = neighbours[order[at]];
        std::sort(next.begin(), next.end(), fewer);
        for (std::size_t j : next)
          if (!seen[j]) {
            seen[j] = 1;
            order.push_back(j);
          }
      }
    }
    std::vector<int> paths;
    for (std::size_t i : order) paths.push_back(group.paths[i]);
    group.paths = paths;
  }

  std::vector<int> parents_;
  const CouplingSystem& couplings_;
  std::vector<LoopPath> paths_;
  std::vector<Group> groups_;
};

// Rows of a loop; transforms points and axes from link frames to the body frames of their carriers.
LoopPlan<double> loop_plan(const Model& model, const Plan<double>& plan, const LoopPath& path,
                           const LoopRows& rows) {
  const Loop& loop = model.loops[path.loop];
  const Pose in_a = loop.link_a == ground ? Pose() : plan.frame_in_carrier[loop.link_a];
  const Pose in_b = loop.link_b == ground ? Pose() : plan.frame_in_carrier[loop.link_b];
  LoopPlan<double> out;
  out.loop = path.loop;
  out.body_a = path.body_a;
  out.body_b = path.body_b;
  out.point_a = in_a.rotation * loop.point_a + in_a.position;
  out.point_b = in_b.rotation * loop.point_b + in_b.position;
  out.summand = std::max(in_a.position.norm(), in_b.position.norm());
  for (std::size_t k = 0; k < rows.rows.size(); ++k) {
    const LoopRow& given = rows.rows[k];
    ConstraintRow<double> row;
    using Kind = ConstraintRow<double>::Kind;
    row.index = given.index;
    row.kind = given.rotation    ? Kind::rotation
               : given.on_ground ? Kind::position_on_root
                                 : Kind::position_on_a;
    row.u = given.on_ground ? given.u : Vec3<double>(in_a.rotation * given.u);
    row.v = in_b.rotation * given.v;
    out.rows.push_back(row);
  }
  return out;
}

// Adds the crossings of a cluster. Its loops and couplings, in the order of `paths`, are plan.loops from
// cluster.first_loop on and plan.couplings from cluster.first_coupling on.
void add_crossings(const Plan<double>& plan, const ClusterBuilder& builder, const std::vector<int>& paths,
                   ClusterPlan& cluster) {
  auto contains = [](const std::vector<int>& list, int joint) {
    return std::count(list.begin(), list.end(), joint) > 0;
  };
  for (int joint : cluster.joints) {
    cluster.crossing_begin.push_back(static_cast<int>(cluster.crossings.size()));
    int next_loop = cluster.first_loop, next_coupling = cluster.first_coupling;
    for (int index : paths) {
      const LoopPath& path = builder.path(index);
      const int at = path.loop < 0 ? next_coupling++ : next_loop++;
      const bool on_a = contains(path.joints_a, joint), on_b = contains(path.joints_b, joint);
      const bool shared = contains(builder.shared_joints(path, cluster.root), joint) || (on_a && on_b);
      if (!on_a && !on_b && !shared) continue;
      if (path.loop < 0) {
        cluster.crossings.push_back(coupling_crossing(plan.couplings[static_cast<std::size_t>(at)], joint));
        continue;
      }
      const LoopPlan<double>& loop = plan.loops[static_cast<std::size_t>(at)];
      for (int row = loop.first_row; row < loop.first_row + static_cast<int>(loop.rows.size()); ++row)
        cluster.crossings.push_back(
            {row, at, shared || on_a ? 0 : 1, row == loop.first_row, shared, joint == path.meeting});
    }
  }
  cluster.crossing_begin.push_back(static_cast<int>(cluster.crossings.size()));
  CouplingWrenches wrenches;
  add_wrenches(cluster, 0, wrenches);
  set_inboard_wrenches(cluster, plan, wrenches);
}

// Rows are coupled within a loop and between loops that cross a common joint.
void set_envelope(ClusterPlan& cluster) {
  cluster.first_coupled.resize(static_cast<std::size_t>(cluster.row_count));
  std::iota(cluster.first_coupled.begin(), cluster.first_coupled.end(), 0);
  for (std::size_t k = 0; k + 1 < cluster.crossing_begin.size(); ++k) {
    const auto begin = cluster.crossings.begin() + cluster.crossing_begin[k];
    const auto end = cluster.crossings.begin() + cluster.crossing_begin[k + 1];
    int lowest = cluster.row_count;
    for (auto p = begin; p != end; ++p) lowest = std::min(lowest, p->row - cluster.first_row);
    for (auto p = begin; p != end; ++p) {
      int& first = cluster.first_coupled[p->row - cluster.first_row];
      first = std::min(first, lowest);
    }
  }
}

// Per joint, the step that eliminates it: its cluster, or the joint itself outside all clusters.
std::vector<EliminationStep> steps_of_joints(const Plan<double>& plan) {
  std::vector<EliminationStep> step_of;
  for (std::size_t i = 0; i < plan.joints.size(); ++i)
    step_of.push_back({EliminationStep::Kind::joint, static_cast<int>(i)});
  for (std::size_t c = 0; c < plan.clusters.size(); ++c)
    for (int joint : plan.clusters[c].joints)
      step_of[joint] = {EliminationStep::Kind::cluster, static_cast<int>(c)};
  return step_of;
}

// The body into which a step eliminates its joints.
int root_of(const Plan<double>& plan, const EliminationStep& step) {
  if (step.kind == EliminationStep::Kind::cluster) return plan.clusters[step.index].root;
  if (step.kind == EliminationStep::Kind::front) return plan.fronts[step.index].root;
  return plan.joints[step.index].parent;
}

// Order of the steps from the leaves to the root, in the tree whose nodes are the steps.
std::vector<EliminationStep> elimination_order(const Plan<double>& plan,
                                               const std::vector<EliminationStep>& step_of) {
  using Kind = EliminationStep::Kind;
  const int n = static_cast<int>(plan.joints.size());
  // depth of a step: depth of its root plus 1; parents have smaller indices
  std::vector<int> depth(plan.joints.size());
  for (int i = 0; i < n; ++i) {
    const int root = root_of(plan, step_of[i]);
    depth[i] = root == ground ? 0 : depth[root] + 1;
  }
  std::vector<std::vector<EliminationStep>> of_depth(plan.joints.size());
  for (int i = n - 1; i >= 0; --i) {
    const EliminationStep& step = step_of[i];
    const bool leaf = step.kind == Kind::joint ||
                      (step.kind == Kind::cluster ? plan.clusters[step.index].joints.front()
                                                  : plan.fronts[step.index].joints.front()) == i;
    if (leaf) of_depth[static_cast<std::size_t>(depth[i])].push_back(step);
  }
  std::vector<EliminationStep> order;
  for (auto steps = of_depth.rbegin(); steps != of_depth.rend(); ++steps)
    order.insert(order.end(), steps->begin(), steps->end());
  return order;
}

// Adds one cluster with its loops and couplings to the plan. Sets `coupling_rows` to the global row index of
// each entry of CouplingSystem::rows.
void add_cluster(const Model& model, const std::vector<LoopRows>& rows, const ClusterBuilder& builder,
                 const ClusterBuilder::Group& group, std::vector<int>& coupling_rows, Plan<double>& plan) {
  ClusterPlan cluster;
  cluster.root = group.root;
  cluster.joints = group.joints;
  cluster.first_loop = static_cast<int>(plan.loops.size());
  if (!plan.clusters.empty()) {
    const ClusterPlan& last = plan.clusters.back();
    cluster.first_row = last.first_row + last.row_count;
    cluster.first_crossing = last.end_crossing();
  }
  cluster.first_coupling = static_cast<int>(plan.couplings.size());
  for (int index : group.paths) {
    const LoopPath& path = builder.path(index);
    if (path.loop < 0) {
      const int row = coupling_rows[path.coupling] = cluster.first_row + cluster.row_count++;
      plan.couplings.push_back({builder.coupling_row(path), path.meeting, row});
      continue;
    }
    LoopPlan<double> loop = loop_plan(model, plan, path, rows[path.loop]);
    loop.root = path.meeting;
    loop.first_row = cluster.first_row + cluster.row_count;
    cluster.row_count += static_cast<int>(loop.rows.size());
    plan.loops.push_back(loop);
  }
  cluster.loop_count = static_cast<int>(plan.loops.size()) - cluster.first_loop;
  cluster.coupling_count = static_cast<int>(plan.couplings.size()) - cluster.first_coupling;
  add_crossings(plan, builder, group.paths, cluster);
  set_envelope(cluster);
  plan.clusters.push_back(cluster);
}

// Builds fronts if the recursion uses them, and the elimination orders with and without fronts.
void set_elimination(Plan<double>& plan) {
  std::vector<EliminationStep> step_of = steps_of_joints(plan);
  plan.elimination = elimination_order(plan, step_of);
  if constexpr (Plan<double>::may_have_fronts) build_fronts(plan);
  if (!plan.has_fronts()) return;
  for (std::size_t f = 0; f < plan.fronts.size(); ++f)
    for (int joint : plan.fronts[f].joints)
      step_of[joint] = {EliminationStep::Kind::front, static_cast<int>(f)};
  plan.elimination_by_fronts = elimination_order(plan, step_of);
}

}  // namespace

void build_clusters(const Model& model, Plan<double>& plan) {
  if (!features::loops || (model.loops.empty() && model.couplings.empty())) return;
  std::vector<int> parents;
  for (const auto& joint : plan.joints) parents.push_back(joint.parent);
  const std::vector<LoopRows> rows = loop_rows_of(model);
  const CouplingSystem couplings = coupling_system(model, parents, plan.carrier);
  const ClusterBuilder builder(model, parents, plan.carrier, rows, couplings);
  std::vector<int> coupling_rows(couplings.rows.size());
  for (const auto& group : builder.groups()) add_cluster(model, rows, builder, group, coupling_rows, plan);
  if (plan.clusters.empty()) return;
  set_elimination(plan);
  const Parameters<double> parameters = parameters_of(model);
  for (const auto& joint : plan.joints)
    plan.joint_units.push_back(motion_scale(model, parameters, joint.link));
  plan.coupling_multipliers = couplings.multipliers;
  for (auto& parts : plan.coupling_multipliers)
    for (MultiplierPart& part : parts) part.row = coupling_rows[part.row];
}

}  // namespace redysim
