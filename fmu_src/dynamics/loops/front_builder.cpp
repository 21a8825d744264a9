#include "dynamics/loops/front_builder.hpp"

#include <algorithm>

#include "dynamics/loops/coupling_crossings.hpp"
#include "dynamics/loops/loop_sides.hpp"
#include "model/any_of.hpp"

namespace redysim {

namespace {

// One loop or coupling of a cluster as joint and row indices.
struct FrontLoop : LoopSides {             // up to the root
  int loop = -1;                           // index into Plan::loops; -1: a coupling
  const CouplingPlan* coupling = nullptr;  // null: a loop
  int root = ground;
  int first_row = 0, row_count = 0;
};

FrontLoop front_loop(const Plan<double>& plan, int index) {
  const LoopPlan<double>& loop = plan.loops[index];
  FrontLoop path;
  path.loop = index;
  path.root = loop.root;
  path.first_row = loop.first_row;
  path.row_count = static_cast<int>(loop.rows.size());
  for (int body = loop.body_a; body != loop.root; body = plan.joints[body].parent)
    path.joints_a.push_back(body);
  for (int body = loop.body_b; body != loop.root; body = plan.joints[body].parent)
    path.joints_b.push_back(body);
  return path;
}

FrontLoop front_coupling(const Plan<double>& plan, const CouplingPlan& coupling) {
  FrontLoop path;
  path.coupling = &coupling;
  path.root = coupling.root;
  path.first_row = coupling.row;
  path.row_count = 1;
  for (int joint : coupling.joints)
    for (; joint != coupling.root && !path.on_a(joint); joint = plan.joints[joint].parent)
      path.joints_a.push_back(joint);
  return path;
}

// The fronts of one cluster, deepest first.
class FrontBuilder {
 public:
  FrontBuilder(const Plan<double>& plan, const ClusterPlan& cluster)
      : plan_(plan),
        joints_(cluster.joints),
        first_row_(cluster.first_row),
        front_of_row_(cluster.row_count) {
    for (int k = 0; k < cluster.loop_count; ++k) loops_.push_back(front_loop(plan, cluster.first_loop + k));
    for (int k = 0; k < cluster.coupling_count; ++k)
      loops_.push_back(front_coupling(plan, plan.couplings[cluster.first_coupling + k]));
    make_fronts();
    std::vector<int> parents;
    for (const auto& joint : plan.joints) parents.push_back(joint.parent);
    assign_joints(parents);
    find_open_rows();
  }

  std::vector<FrontPlan>& fronts() { return fronts_; }

  // Assigns the indices of crossings and matrix entries, starting at the given ones, and advances these.
  void set_indices(int& next_crossing, int& next_entry) {
    for (FrontPlan& front : fronts_) {
      front.first_crossing = next_crossing;
      front.first_entry = next_entry;
      next_crossing += static_cast<int>(front.crossings.size());
      next_entry += static_cast<int>((front.rows.size() + front.open.size()) * front.rows.size());
    }
    CouplingWrenches wrenches;
    // one evaluation may use the fronts of some clusters and the crossings of others: both need own wrenches
    const int behind_clusters = plan_.clusters.back().end_crossing();
    for (FrontPlan& front : fronts_) add_wrenches(front, behind_clusters, wrenches);
    for (FrontPlan& front : fronts_) {
      set_inboard_wrenches(front, plan_, wrenches);
      for (int row : front.open) {
        const auto found = wrenches.find({row, front.root});
        front.open_wrench.push_back(found == wrenches.end() ? -1 : found->second);
      }
      std::vector<int> rows;
      for (std::size_t k = 0; k < front.joints.size(); ++k) {
        rows.clear();
        for (int n = front.crossing_begin[k]; n < front.crossing_begin[k + 1]; ++n)
          rows.push_back(front.crossings[n].row);
        add_entries(rows, front.entries);
      }
      add_entries(front.open, front.open_entries);
    }
  }

  // Approximate number of multiplications of one elimination.
  double work() const {
    double sum = 0;
    for (const FrontPlan& front : fronts_) {
      for (std::size_t k = 0; k < front.joints.size(); ++k)
        sum += crossing_work(front.crossing_begin[k + 1] - front.crossing_begin[k]);
      const double rows = static_cast<double>(front.rows.size()),
                   open = static_cast<double>(front.open.size());
      sum += rows * rows * (rows / 6 + open / 2) + rows * open * open / 2 + 12 * rows * (rows + open);
    }
    return sum;
  }

  // The same for the elimination of the whole cluster.
  static double work(const ClusterPlan& cluster) {
    double sum = 0;
    for (std::size_t k = 0; k + 1 < cluster.crossing_begin.size(); ++k)
      sum += crossing_work(cluster.crossing_begin[k + 1] - cluster.crossing_begin[k]);
    int first = cluster.row_count;
    for (int row = cluster.row_count - 1; row >= 0; --row) {
      first = std::min(first, cluster.first_coupled[row]);
      const double width = row - first;
      sum += width * (width / 2 + 12);
    }
    return sum;
  }

 private:
  static double crossing_work(int rows) { return rows * (60.0 + 0.5 * rows); }

  // One front per body at which loops meet. The roots of coupled fronts lie on one path to the ground, so
  // deeper ones have larger indices.
  void make_fronts() {
    std::vector<int> roots;
    for (const FrontLoop& loop : loops_) roots.push_back(loop.root);
    std::sort(roots.begin(), roots.end(), std::greater<int>());
    roots.erase(std::unique(roots.begin(), roots.end()), roots.end());
    for (int root : roots) {
      FrontPlan front;
      front.root = root;
      for (const FrontLoop& loop : loops_)
        if (loop.root == root)
          for (int row = 0; row < loop.row_count; ++row) {
            front.rows.push_back(loop.first_row + row);
            front_of_row_[loop.first_row + row - first_row_] = fronts_.size();
          }
      fronts_.push_back(std::move(front));
    }
  }

  int front_at(int root) const {
    const auto here = [root](const FrontPlan& front) { return front.root == root; };
    return static_cast<int>(std::find_if(fronts_.begin(), fronts_.end(), here) - fronts_.begin());
  }

  // Assigns each joint to the deepest front with a loop that crosses this joint or an inboard one, with the
  // crossings of all loops that are still open there.
  void assign_joints(const std::vector<int>& parents) {
    std::vector<int> deepest(parents.size(), ground);  // root of the front
    for (auto joint = joints_.rbegin(); joint != joints_.rend(); ++joint) {
      if (parents[*joint] != ground) deepest[*joint] = deepest[parents[*joint]];
      for (const FrontLoop& loop : loops_)
        if (loop.crosses(*joint)) deepest[*joint] = std::max(deepest[*joint], loop.root);
    }
    for (int joint : joints_) {
      FrontPlan& front = fronts_[front_at(deepest[joint])];
      front.joints.push_back(joint);
      front.crossing_begin.push_back(static_cast<int>(front.crossings.size()));
      for (const FrontLoop& loop : loops_)
        if (loop.crosses(joint)) add_crossings(loop, joint, front);
    }
    for (FrontPlan& front : fronts_) front.crossing_begin.push_back(static_cast<int>(front.crossings.size()));
  }

  static void add_crossings(const FrontLoop& loop, int joint, FrontPlan& front) {
    if (loop.coupling) return front.crossings.push_back(coupling_crossing(*loop.coupling, joint));
    const bool shared = loop.on_a(joint) && loop.on_b(joint);
    for (int row = 0; row < loop.row_count; ++row)
      front.crossings.push_back(
          {loop.first_row + row, loop.loop, loop.on_a(joint) ? 0 : 1, row == 0, shared, false});
  }

  // Rows are coupled if they cross a common joint. Eliminating other rows adds no coupling between two open
  // rows, because both already cross the root's joint.
  void find_open_rows() {
    for (FrontPlan& front : fronts_) {
      for (const FrontLoop& loop : loops_) {
        if (loop.root >= front.root || !loop.crosses(front.root)) continue;
        const bool has_coupling = any_of(loops_, [&](const FrontLoop& other) {
          return other.root == front.root && loop.is_coupled_to(other);
        });
        if (!has_coupling) continue;
        for (int row = 0; row < loop.row_count; ++row) {
          front.open.push_back(loop.first_row + row);
          front.open_side.push_back(loop.coupling ? -1 : side_at_root(front, loop));
        }
      }
    }
  }

  // The side of an open loop whose wrenches have arrived at the front's root. If both sides cross the root's
  // joint, the other side may end outside the front; it is then transmitted later.
  static int side_at_root(const FrontPlan& front, const FrontLoop& loop) {
    const auto of_loop = [&loop](const RowCrossing& crossing) { return crossing.row == loop.first_row; };
    return std::find_if(front.crossings.rbegin(), front.crossings.rend(), of_loop)->side;
  }

  const FrontPlan& front_of(int row) const { return fronts_[front_of_row_[row - first_row_]]; }

  // Index of S_rs for each pair of rows (n, m <= n), in the matrix of the front that eliminates one of the
  // two first.
  void add_entries(const std::vector<int>& rows, std::vector<int>& entries) const {
    for (std::size_t n = 0; n < rows.size(); ++n)
      for (std::size_t m = 0; m <= n; ++m) {
        const FrontPlan &one = front_of(rows[n]), &other = front_of(rows[m]);
        const FrontPlan& front = one.root > other.root ? one : other;
        const int i = line_of(front, rows[n]), j = line_of(front, rows[m]);
        entries.push_back(front.first_entry + std::max(i, j) * static_cast<int>(front.rows.size()) +
                          std::min(i, j));
      }
  }

  static int line_of(const FrontPlan& front, int row) {
    const auto at = std::find(front.rows.begin(), front.rows.end(), row);
    if (at != front.rows.end()) return static_cast<int>(at - front.rows.begin());
    const auto open = std::find(front.open.begin(), front.open.end(), row);
    return static_cast<int>(front.rows.size() + (open - front.open.begin()));
  }

  const Plan<double>& plan_;
  std::vector<int> joints_;
  int first_row_;
  std::vector<std::size_t> front_of_row_;
  std::vector<FrontLoop> loops_;
  std::vector<FrontPlan> fronts_;
};

}  // namespace

void build_fronts(Plan<double>& plan) {
  int next_crossing = 0, next_entry = 0;
  for (ClusterPlan& cluster : plan.clusters) {
    const auto prescribed = [&plan](int joint) { return plan.joints[joint].prescribed; };
    if (any_of(cluster.joints, prescribed)) continue;
    FrontBuilder builder(plan, cluster);
    if (builder.fronts().size() < 2 || builder.work() >= FrontBuilder::work(cluster)) continue;
    builder.set_indices(next_crossing, next_entry);
    cluster.split = true;
    for (FrontPlan& front : builder.fronts()) plan.fronts.push_back(std::move(front));
  }
}

}  // namespace redysim
