#include "dynamics/loops/coupling_chains.hpp"

#include <algorithm>
#include <map>

namespace redysim {

namespace {

constexpr std::size_t few = 4;  // maximum number of couplings that are not replaced

// A coupling of two joints: r_a q_a + r_b q_b = offset.
struct Edge {
  int coupling, a, b;
  double ratio_a, ratio_b, offset;

  int other(int joint) const { return joint == a ? b : a; }
  double ratio(int joint) const { return joint == a ? ratio_a : ratio_b; }
};

// Depth-first numbers of the joints: neighbours in the tree have close numbers.
std::vector<int> depth_first_numbers(const std::vector<int>& parents) {
  const std::size_t n = parents.size();
  std::vector<int> sizes(n, 1), numbers(n, 0), next(n + 1, 0);  // next free number below joint i; [n]: ground
  for (std::size_t i = n; i-- > 0;)
    if (parents[i] != ground) sizes[parents[i]] += sizes[i];
  for (std::size_t i = 0; i < n; ++i) {
    int& free = next[parents[i] == ground ? n : static_cast<std::size_t>(parents[i])];
    numbers[i] = free;
    free += sizes[i];
    next[i] = numbers[i] + 1;
  }
  return numbers;
}

// Joints connected by edges without a cycle: q_j = slope_j x + shift_j with one unknown x.
class Chain {
 public:
  // `edges`: of one connected component.
  Chain(std::vector<Edge> edges, const std::vector<int>& numbers) : edges_(std::move(edges)) {
    for (std::size_t e = 0; e < edges_.size(); ++e)
      for (int joint : {edges_[e].a, edges_[e].b}) at_[joint].push_back(e);
    solve_from(edges_.front().a);
    for (const auto& [joint, edge] : at_) joints_.push_back(joint);
    std::sort(joints_.begin(), joints_.end(), [&](int i, int j) { return numbers[i] < numbers[j]; });
  }

  bool is_tree() const { return at_.size() == edges_.size() + 1; }

  void add_rows(CouplingSystem& system) {
    const int first = static_cast<int>(system.rows.size());
    for (std::size_t k = 0; k + 1 < joints_.size(); ++k) {
      const int c = joints_[k], d = joints_[k + 1];
      const double ratio = slope_[d] / slope_[c];
      system.rows.push_back({edges_[k].coupling, {d, c}, {1, -ratio}, shift_[d] - ratio * shift_[c]});
    }
    for (const Edge& edge : edges_) {
      // virtual work of the joints beyond the edge, which move along x
      const std::vector<char> beyond = part_beyond(edge);
      const double lever = edge.ratio_b * slope_[edge.b];
      for (std::size_t k = 0; k + 1 < joints_.size(); ++k)
        if (beyond[k] != beyond[k + 1])
          system.multipliers[edge.coupling].push_back(
              {first + static_cast<int>(k), (beyond[k + 1] ? 1 : -1) * slope_[joints_[k + 1]] / lever});
    }
  }

 private:
  void solve_from(int start) {
    slope_[start] = 1;
    shift_[start] = 0;
    std::vector<int> open{start};
    while (!open.empty()) {
      const int joint = open.back();
      open.pop_back();
      for (std::size_t e : at_[joint]) {
        const Edge& edge = edges_[e];
        const int other = edge.other(joint);
        if (slope_.count(other)) continue;
        slope_[other] = -edge.ratio(joint) * slope_[joint] / edge.ratio(other);
        shift_[other] = (edge.offset - edge.ratio(joint) * shift_[joint]) / edge.ratio(other);
        open.push_back(other);
      }
    }
  }

  // Per joint of joints_: whether it is connected to edge.b without using the edge.
  std::vector<char> part_beyond(const Edge& without) {
    std::map<int, char> reached{{without.b, 1}};
    std::vector<int> open{without.b};
    while (!open.empty()) {
      const int joint = open.back();
      open.pop_back();
      for (std::size_t e : at_[joint]) {
        const int other = edges_[e].other(joint);
        if (&edges_[e] != &without && reached.insert({other, 1}).second) open.push_back(other);
      }
    }
    std::vector<char> beyond;
    for (int joint : joints_) beyond.push_back(static_cast<char>(reached.count(joint)));
    return beyond;
  }

  std::vector<Edge> edges_;
  std::map<int, std::vector<std::size_t>> at_;  // per joint: its edges
  std::map<int, double> slope_, shift_;
  std::vector<int> joints_;  // in depth-first order
};

// Groups of edges that share joints, directly or through others.
std::vector<std::vector<Edge>> components(const std::vector<Edge>& edges) {
  std::vector<std::vector<Edge>> groups;
  std::map<int, std::size_t> group_of;  // per joint
  for (const Edge& edge : edges) {
    const auto a = group_of.find(edge.a), b = group_of.find(edge.b);
    const std::size_t into = a != group_of.end()   ? a->second
                             : b != group_of.end() ? b->second
                                                   : groups.size();
    if (into == groups.size()) groups.emplace_back();
    groups[into].push_back(edge);
    if (a != group_of.end() && b != group_of.end() && b->second != into) {
      std::vector<Edge> merged;
      merged.swap(groups[b->second]);
      groups[into].insert(groups[into].end(), merged.begin(), merged.end());
      for (const Edge& moved : merged) group_of[moved.a] = group_of[moved.b] = into;
    }
    group_of[edge.a] = group_of[edge.b] = into;
  }
  return groups;
}

}  // namespace

CouplingSystem coupling_system(const Model& model, const std::vector<int>& parents,
                               const std::vector<int>& carrier) {
  CouplingSystem system;
  system.multipliers.resize(model.couplings.size());
  std::vector<Edge> edges;
  const auto add_as_given = [&](std::size_t k) {
    const Coupling& given = model.couplings[k];
    system.multipliers[k] = {{static_cast<int>(system.rows.size()), 1}};
    CoupledJoints& row = system.rows.emplace_back();
    row.coupling = static_cast<int>(k);
    for (int link : given.links) row.joints.push_back(carrier[link]);
    row.ratios = given.ratios;
    row.offset = given.offset;
  };
  for (std::size_t k = 0; k < model.couplings.size(); ++k) {
    const Coupling& given = model.couplings[k];
    if (!given.rigid()) continue;
    if (given.links.size() == 2)
      edges.push_back({static_cast<int>(k), carrier[given.links[0]], carrier[given.links[1]], given.ratios[0],
                       given.ratios[1], given.offset});
    else
      add_as_given(k);
  }
  const std::vector<int> numbers = depth_first_numbers(parents);
  for (const std::vector<Edge>& group : components(edges)) {
    if (group.empty()) continue;
    Chain chain(group, numbers);
    if (group.size() > few && chain.is_tree())
      chain.add_rows(system);
    else
      for (const Edge& edge : group) add_as_given(static_cast<std::size_t>(edge.coupling));
  }
  return system;
}

}  // namespace redysim
