#include "math/tape.hpp"

#include <algorithm>
#include <cmath>

namespace redysim {
namespace {

const std::map<std::string, double (*)(double)> functions = {{"sin", std::sin},   {"cos", std::cos},
                                                             {"sqrt", std::sqrt}, {"abs", std::fabs},
                                                             {"tanh", std::tanh}, {"exp", std::exp}};

// Result of an operation on two values.
double arithmetic(Tape::Operation operation, double left, double right) {
  if (operation == Tape::Operation::add) return left + right;
  if (operation == Tape::Operation::subtract) return left - right;
  if (operation == Tape::Operation::multiply) return left * right;
  return left / right;
}

}  // namespace

int Tape::constant(double value) {
  if (value == 0) value = 0;  // -0 and 0 share one node
  const auto [place, fresh] = constants_.try_emplace(value, size());
  if (fresh) nodes_.push_back({Operation::constant, value, {}, -1, -1});
  return place->second;
}

int Tape::symbol(const std::string& name) {
  return add({Operation::symbol, 0, name, -1, -1}, {Operation::symbol, -1, -1, name});
}

int Tape::function(const std::string& name, int argument) {
  return add({Operation::function, 0, name, argument, -1}, {Operation::function, argument, -1, name});
}

bool Tape::is_constant(int node, double value) const {
  const Node& given = (*this)[node];
  return given.operation == Operation::constant && given.value == value;
}

bool Tape::is_turn(int node) const {
  const Node& given = (*this)[node];
  return given.operation == Operation::function && (given.name == "sin" || given.name == "cos");
}

int Tape::add(Node node, const Key& key) {
  const auto [place, fresh] = known_.try_emplace(key, size());
  if (fresh) nodes_.push_back(std::move(node));
  return place->second;
}

int Tape::apply(Operation operation, int left, int right) {
  const int known = simplified(operation, left, right);
  if (known >= 0) return known;
  const bool commutes = operation == Operation::add || operation == Operation::multiply;
  if (commutes && left > right) std::swap(left, right);
  return add({operation, 0, {}, left, right}, {operation, left, right, {}});
}

// Returns a node with the same value that needs no new operation, or -1 if there is none.
int Tape::simplified(Operation operation, int left, int right) {
  const Node a = (*this)[left], b = (*this)[right];
  if (a.operation == Operation::constant && b.operation == Operation::constant)
    return constant(arithmetic(operation, a.value, b.value));
  switch (operation) {
    case Operation::add:
      return simplified_sum(left, right);
    case Operation::subtract:
      return simplified_difference(left, right);
    case Operation::multiply:
      return simplified_product(left, right);
    case Operation::divide:
      if (is_constant(left, 0)) return constant(0);
      return is_constant(right, 1) ? left : -1;
    case Operation::constant:
    case Operation::symbol:
    case Operation::negate:
    case Operation::function:
      break;
  }
  return -1;
}

int Tape::negated(int node) {
  const Node of = (*this)[node];
  if (of.operation == Operation::negate) return of.left;
  if (of.operation == Operation::subtract) return apply(Operation::subtract, of.right, of.left);
  return add({Operation::negate, 0, {}, node, -1}, {Operation::negate, node, -1, {}});
}

int Tape::simplified_sum(int left, int right) {
  const Node a = (*this)[left], b = (*this)[right];
  if (is_constant(left, 0)) return right;
  if (is_constant(right, 0)) return left;
  if (b.operation == Operation::negate) return apply(Operation::subtract, left, b.left);
  if (a.operation == Operation::negate) return apply(Operation::subtract, right, a.left);
  return -1;
}

int Tape::simplified_difference(int left, int right) {
  const Node b = (*this)[right];
  if (left == right) return constant(0);
  if (is_constant(right, 0)) return left;
  if (is_constant(left, 0)) return negated(right);
  if (b.operation == Operation::negate) return apply(Operation::add, left, b.left);
  return -1;
}

int Tape::simplified_product(int left, int right) {
  const Node a = (*this)[left], b = (*this)[right];
  if (is_constant(left, 0) || is_constant(right, 0)) return constant(0);
  if (is_constant(left, 1)) return right;
  if (is_constant(right, 1)) return left;
  if (is_constant(left, -1)) return negated(right);
  if (is_constant(right, -1)) return negated(left);
  if (a.operation == Operation::negate) return negated(apply(Operation::multiply, a.left, right));
  if (b.operation == Operation::negate) return negated(apply(Operation::multiply, left, b.left));
  return -1;
}

std::vector<char> Tape::needed_by(const std::vector<int>& results) const {
  std::vector<char> needed(nodes_.size(), 0);
  for (int node : results) needed[static_cast<std::size_t>(node)] = 1;
  for (int node = size() - 1; node >= 0; --node) {
    if (!needed[static_cast<std::size_t>(node)]) continue;
    for (int operand : {(*this)[node].left, (*this)[node].right})
      if (operand >= 0) needed[static_cast<std::size_t>(operand)] = 1;
  }
  return needed;
}

bool Tape::computes(int node) const {
  return node >= 0 && (*this)[node].operation != Operation::constant &&
         (*this)[node].operation != Operation::symbol;
}

std::vector<int> Tape::operations_for(const std::vector<int>& results) const {
  const std::vector<char> needed = needed_by(results);
  std::vector<int> found;
  for (int node = 0; node < size(); ++node)
    if (needed[static_cast<std::size_t>(node)] && computes(node)) found.push_back(node);
  return found;
}

double Tape::value(const Node& node, const std::vector<double>& of) const {
  if (node.operation == Operation::constant) return node.value;
  const double left = of[static_cast<std::size_t>(node.left)];
  if (node.operation == Operation::function) return functions.at(node.name)(left);
  if (node.operation == Operation::negate) return -left;
  return arithmetic(node.operation, left, of[static_cast<std::size_t>(node.right)]);
}

std::vector<double> Tape::values(const std::vector<int>& results,
                                 const std::map<std::string, double>& symbols) const {
  const std::vector<char> needed = needed_by(results);
  std::vector<double> all(nodes_.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!needed[i]) continue;
    const Node& node = nodes_[i];
    all[i] = node.operation == Operation::symbol ? symbols.at(node.name) : value(node, all);
  }
  std::vector<double> found;
  for (int node : results) found.push_back(all[static_cast<std::size_t>(node)]);
  return found;
}

}  // namespace redysim
