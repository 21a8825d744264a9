#include "dynamics/pose_plan.hpp"

#include <algorithm>
#include <vector>

#include "dynamics/plan.hpp"

namespace redysim {
namespace {

class PoseBuilder {
 public:
  explicit PoseBuilder(Plan<double>& plan) : plan_(plan), bodies_(plan.joints.size()) {}

  void build() {
    mark_bodies();
    plan_.pose_count = static_cast<int>(bodies_.size());
    for (const ClusterPlan& cluster : plan_.clusters)
      for (int joint : cluster.joints)
        if (cluster.loop_count > 0) bodies_[joint].cluster_root = cluster.root;
    for (std::size_t i = 0; i < bodies_.size(); ++i)
      if (bodies_[i].needed) add_body(static_cast<int>(i));
    set_entries_of_loops();
    for (auto& spring : plan_.springs) set_entries(spring);
    for (auto& bushing : plan_.bushings) set_entries(bushing);
    for (auto& pair : plan_.contact_pairs) {
      pair.sphere_entry = lifted(pair.sphere_body);
      pair.surface_entry = lifted(pair.surface_body);
    }
    for (auto& port : plan_.ports)
      if (port.in_ground_axes) port.entry = lifted(port.body);
  }

 private:
  // Further entries of Workspace::ground of a body; ground: none.
  struct Body {
    bool needed = false;
    int cluster_root = ground;  // root of its joint's cluster
    int reference = ground;     // body to which positions of its own entry are relative; ground: plan.origin
    int as_root = ground, lifted = ground;
  };

  void mark(int body) {
    for (; body != ground; body = plan_.joints[body].parent) bodies_[body].needed = true;
  }

  void mark_bodies() {
    const auto mark_ends = [this](const auto& element) {
      mark(element.body_a);
      mark(element.body_b);
    };
    std::for_each(plan_.springs.begin(), plan_.springs.end(), mark_ends);
    std::for_each(plan_.bushings.begin(), plan_.bushings.end(), mark_ends);
    std::for_each(plan_.loops.begin(), plan_.loops.end(), mark_ends);
    for (const auto& pair : plan_.contact_pairs) {
      mark(pair.sphere_body);
      mark(pair.surface_body);
    }
    for (const auto& port : plan_.ports)
      if (port.in_ground_axes) mark(port.body);
  }

  void add_body(int i) {
    Body& body = bodies_[i];
    const int parent = plan_.joints[i].parent;
    int from = parent;
    if (body.cluster_root != ground) {
      body.reference = body.cluster_root;
      if (parent == body.reference) from = as_root(parent);
    } else if (parent != ground) {
      body.reference = bodies_[parent].reference;
    }
    plan_.poses.push_back({PoseStep::Kind::moved, i, i, from, ground, body.reference});
  }

  // The entry of a cluster's root relative to its own origin.
  int as_root(int i) {
    int& entry = bodies_[i].as_root;
    if (entry == ground) {
      entry = plan_.pose_count++;
      plan_.poses.push_back({PoseStep::Kind::root, i, entry, i, ground, i});
    }
    return entry;
  }

  // The entry of a body relative to plan.origin.
  int lifted(int i) {
    if (i == ground || bodies_[i].reference == ground) return i;
    int& entry = bodies_[i].lifted;
    if (entry == ground) {
      const int base = lifted(bodies_[i].reference);
      entry = plan_.pose_count++;
      plan_.poses.push_back({PoseStep::Kind::lifted, i, entry, i, base, ground});
    }
    return entry;
  }

  void set_entries_of_loops() {
    for (ClusterPlan& cluster : plan_.clusters) {
      if (cluster.root != ground) cluster.root_entry = bodies_[cluster.root].as_root;
      for (int k = cluster.first_loop; k < cluster.first_loop + cluster.loop_count; ++k) {
        LoopPlan<double>& loop = plan_.loops[k];
        loop.entry_a = seen_from(cluster.root, loop.body_a);
        loop.entry_b = seen_from(cluster.root, loop.body_b);
        loop.entry_root = seen_from(cluster.root, loop.root);
      }
    }
  }

  // The entry of a body of a cluster relative to the origin of the cluster's root.
  int seen_from(int root, int i) const { return i == root && root != ground ? bodies_[root].as_root : i; }

  // Sets the entries of an element; if both bodies are in one cluster, positions are relative to its root.
  template <class Element>
  void set_entries(Element& element) {
    const auto is_seen_from = [this](int root, int i) {
      return i == root || (i != ground && bodies_[i].reference == root);
    };
    for (const int body : {element.body_a, element.body_b}) {
      const int root = body == ground ? ground : bodies_[body].reference;
      if (root == ground || !is_seen_from(root, element.body_a) || !is_seen_from(root, element.body_b))
        continue;
      element.entry_a = seen_from(root, element.body_a);
      element.entry_b = seen_from(root, element.body_b);
      return;
    }
    element.entry_a = lifted(element.body_a);
    element.entry_b = lifted(element.body_b);
  }

  Plan<double>& plan_;
  std::vector<Body> bodies_;
};

}  // namespace

void set_poses(Plan<double>& plan) { PoseBuilder(plan).build(); }

}  // namespace redysim
