#include "dynamics/straight_line/statement_order.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

namespace redysim {
namespace {

using Operation = Tape::Operation;

// The operations that the results need, and the users of each operation.
class Uses {
 public:
  Uses(const Tape& tape, const std::vector<int>& results)
      : tape_(tape),
        operations_(tape.operations_for(results)),
        users_(static_cast<std::size_t>(tape.size())) {
    for (int node : operations_)
      for (int operand : operands(node)) users_[static_cast<std::size_t>(operand)].push_back(node);
  }
  const std::vector<int>& operations() const { return operations_; }
  const std::vector<int>& users(int node) const { return users_[static_cast<std::size_t>(node)]; }

  // The operands, each once, without constants and symbols.
  std::vector<int> operands(int node) const {
    std::vector<int> found;
    const int left = tape_[node].left, right = tape_[node].right;
    if (tape_.computes(left)) found.push_back(left);
    if (right != left && tape_.computes(right)) found.push_back(right);
    return found;
  }

 private:
  const Tape& tape_;
  std::vector<int> operations_;
  std::vector<std::vector<int>> users_;
};

// Orders the operations of one chain: of those whose operands in the chain are known, the next one is that
// with the most last uses of values.
class Chain {
 public:
  Chain(const Uses& uses, const std::vector<int>& members, int nodes)
      : uses_(uses), states_(static_cast<std::size_t>(nodes)) {
    for (int node : members) state(node) = {true, false, 0, 0, static_cast<int>(uses.users(node).size())};
    for (int node : members)
      for (int operand : uses.operands(node)) {
        if (!state(operand).member) continue;
        ++state(node).missing;
        if (state(operand).uses_left == 1) ++state(node).last_uses;
      }
    for (int node : members)
      if (state(node).missing == 0) ready_.insert(key(node));
    while (!ready_.empty()) take(ready_.begin()->second);
  }
  const std::vector<int>& order() const { return order_; }

 private:
  struct State {
    bool member = false, taken = false;
    int missing = 0, last_uses = 0;  // operands: not yet known; used for the last time
    int uses_left = 0;
  };
  State& state(int node) { return states_[static_cast<std::size_t>(node)]; }
  std::pair<int, int> key(int node) { return {-state(node).last_uses, node}; }

  void take(int node) {
    ready_.erase(key(node));
    order_.push_back(node);
    state(node).taken = true;
    for (int operand : uses_.operands(node))
      if (state(operand).member && --state(operand).uses_left == 1) prefer_last_user(operand);
    for (int user : uses_.users(node))
      if (state(user).member && --state(user).missing == 0) ready_.insert(key(user));
  }

  void prefer_last_user(int operand) {
    for (int user : uses_.users(operand)) {
      if (!state(user).member || state(user).taken) continue;
      const bool waits = ready_.erase(key(user)) > 0;
      ++state(user).last_uses;
      if (waits) ready_.insert(key(user));
    }
  }

  const Uses& uses_;
  std::vector<State> states_;
  std::set<std::pair<int, int>> ready_;
  std::vector<int> order_;
};

bool is_speed_or_force(const std::string& symbol) {
  return symbol.rfind("qd[", 0) == 0 || symbol.rfind("tau[", 0) == 0;
}

enum class Part { positions, forces, solution };

// Part of each operation: whether it depends on speeds or forces, and if so, also on a quotient of positions.
std::vector<Part> parts(const Tape& tape) {
  std::vector<Part> found;
  for (int node = 0; node < tape.size(); ++node) {
    const Tape::Node& given = tape[node];
    Part part = given.operation == Operation::symbol && is_speed_or_force(given.name) ? Part::forces
                                                                                      : Part::positions;
    bool divided = false;
    for (int operand : {given.left, given.right}) {
      if (operand < 0) continue;
      part = std::max(part, found[static_cast<std::size_t>(operand)]);
      divided = divided || tape[operand].operation == Operation::divide;
    }
    found.push_back(part == Part::forces && divided ? Part::solution : part);
  }
  return found;
}

// Pieces of both lists in turn, in proportion to their lengths. Accelerations of six to nine joints are
// fastest with pieces of 32 operations; 16 is 1 to 3 % slower, 64 is 3 to 8 % slower.
std::vector<int> alternating(const std::vector<int>& a, const std::vector<int>& b) {
  constexpr std::size_t at_once = 32;
  std::vector<int> both;
  std::size_t i = 0, j = 0;
  const auto add = [&both](const std::vector<int>& from, std::size_t& at) {
    for (const std::size_t end = std::min(from.size(), at + at_once); at < end; ++at)
      both.push_back(from[at]);
  };
  while (i < a.size() || j < b.size()) {
    if (j < b.size() && (i == a.size() || j * a.size() <= i * b.size()))
      add(b, j);
    else
      add(a, i);
  }
  return both;
}

}  // namespace

std::vector<int> statement_order(const Tape& tape, const std::vector<int>& results, bool two_chains) {
  const Uses uses(tape, results);
  const auto ordered = [&](const std::vector<int>& members) {
    return Chain(uses, members, tape.size()).order();
  };
  if (!two_chains) return ordered(uses.operations());
  const std::vector<Part> part = parts(tape);
  std::vector<int> positions, others;
  for (int node : uses.operations())
    (part[static_cast<std::size_t>(node)] == Part::positions ? positions : others).push_back(node);
  others = ordered(others);
  const auto solution = std::stable_partition(others.begin(), others.end(), [&part](int node) {
    return part[static_cast<std::size_t>(node)] == Part::forces;
  });
  std::vector<int> order = alternating({others.begin(), solution}, ordered(positions));
  order.insert(order.end(), solution, others.end());
  return order;
}

}  // namespace redysim
