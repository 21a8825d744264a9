#pragma once

#include <map>
#include <string>
#include <tuple>
#include <vector>

namespace redysim {

// Straight-line code during recording (math/recorded.hpp). Each node is a constant, a symbol or an operation
// on earlier nodes. Constants are folded, products by 0 and 1 are removed, and equal nodes are stored once.
class Tape {
 public:
  enum class Operation { constant, symbol, add, subtract, multiply, divide, negate, function };
  struct Node {
    Operation operation = Operation::constant;
    double value = 0;           // of a constant
    std::string name;           // of a symbol or function
    int left = -1, right = -1;  // operand nodes; -1: none
  };

  int constant(double value);
  int symbol(const std::string& name);  // a value that is known only when the code runs
  int apply(Operation operation, int left, int right);
  int function(const std::string& name, int argument);  // sin, cos, ...

  const Node& operator[](int node) const { return nodes_[static_cast<std::size_t>(node)]; }
  int size() const { return static_cast<int>(nodes_.size()); }
  bool is_constant(int node, double value) const;
  bool is_turn(int node) const;   // sine or cosine
  bool computes(int node) const;  // an operation or function; false for a missing operand (-1)

  // Values of nodes for values of all symbols on which they depend (std::out_of_range: one is missing).
  std::vector<double> values(const std::vector<int>& results,
                             const std::map<std::string, double>& symbols) const;
  // For each node, whether `results` depend on it.
  std::vector<char> needed_by(const std::vector<int>& results) const;
  // The nodes on which `results` depend and that compute something, in increasing order.
  std::vector<int> operations_for(const std::vector<int>& results) const;

 private:
  using Key = std::tuple<Operation, int, int, std::string>;
  int add(Node node, const Key& key);
  int simplified(Operation operation, int left, int right);
  int simplified_sum(int left, int right);
  int simplified_difference(int left, int right);
  int simplified_product(int left, int right);
  int negated(int node);
  double value(const Node& node, const std::vector<double>& of) const;

  std::vector<Node> nodes_;
  std::map<double, int> constants_;
  std::map<Key, int> known_;
};

}  // namespace redysim
