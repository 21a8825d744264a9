#include "dynamics/straight_line/series_statements.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>
#include <utility>

#include "dynamics/straight_line/statements.hpp"
#include "math/lanes.hpp"

// Recursions of Taylor coefficients for each operation on a tape (Hairer, Norsett, Wanner 1993, I.8;
// Griewank, Walther 2008, 13.2). Coefficient k of a product x y is
//   x_0 y_k + x_k y_0 + sum of x_j y_(k - j) over 0 < j < k
// The sums contain lower orders only and are computed first; the statements of order k are then linear in the
// coefficients of order k.

namespace redysim {
namespace {

using Operation = Tape::Operation;
using Places = std::map<int, std::vector<std::size_t>>;  // per node: indices into an array

// Functions satisfy linear differential equations. Coefficient j of dx is rate_j = j x_j:
//   sine: cos(x) dx    cosine: -sin(x) dx    t = tanh x: (1 - t^2) dx
class SeriesWriter {
 public:
  explicit SeriesWriter(const StraightLine& line)
      : tape_(line.tape), joints_(line.qdd.size()), slopes_(line.qdd) {
    slopes_.insert(slopes_.end(), line.power.begin(), line.power.end());
    results_ = slopes_;
    add_partners();
    classify();
    for (int node = 0; node < tape_.size(); ++node)
      if (is_needed(node) && varies(node)) list_product(node);
    left_terms_.resize(products_);
    left_terms_.resize(lanes_for(products_) * 4, "0.0");
    right_terms_ = left_terms_;
    mark_factors();
  }

  std::string text() {
    std::vector<int> recorded(static_cast<std::size_t>(tape_.size()));
    std::iota(recorded.begin(), recorded.end(), 0);
    std::string text =
        "\nconst std::size_t series_lanes = " +
        std::to_string(lanes_for(std::max<std::size_t>(products_, 1))) +
        ", series_quotients = " + std::to_string(reciprocals_.size()) +
        ";\n\nREDYSIM_CLONES void series_values([[maybe_unused]] const Plan<double>& plan, const double* q, "
        "const double* qd,\n    const double* tau, double* __restrict left, double* __restrict right, "
        "[[maybe_unused]] double* reciprocals,\n    double* slope) {\n" +
        value_statements(tape_, results_, recorded,
                         [this](int node) { return kept(node) + reciprocal(node); });
    for (std::size_t i = 0; i < slopes_.size(); ++i) text += assigned("slope", i, name(slopes_[i]));
    text += "}\n\n" + beginning_of_terms();
    for (int node = 0; node < tape_.size(); ++node) text += term(node);
    for (std::size_t i = 0; i < joints_; ++i) text += assigned("next", i, "factor * " + indexed("qd", i));
    for (std::size_t i = 0; i < slopes_.size(); ++i)
      text += assigned("next", joints_ + i, varies(slopes_[i]) ? "factor * " + name(slopes_[i]) : "0.0");
    return text + "}\n";
  }

 private:
  // Code that computes the sums of all products and declares the arrays used by the statements.
  std::string beginning_of_terms() const {
    return "REDYSIM_CLONES void series_terms([[maybe_unused]] const Plan<double>& plan,\n"
           "    const SeriesOrder& at, [[maybe_unused]] const double* tau) {\n"
           "  alignas(Lanes<double>) double sums[4 * series_lanes];\n"
           "  sum_products<series_lanes>(at.left, at.right, at.order, sums);\n"
           "  [[maybe_unused]] const double *left_0 = numbers(at.left), *right_0 = numbers(at.right);\n"
           "  [[maybe_unused]] Lanes<double>* __restrict left = at.left + at.order * series_lanes;\n"
           "  [[maybe_unused]] Lanes<double>* __restrict right = at.right + at.order * series_lanes;\n"
           "  [[maybe_unused]] const double order = static_cast<double>(at.order);\n"
           "  [[maybe_unused]] const double per_order = at.per_order;\n"
           "  const double factor = at.factor;\n"
           "  [[maybe_unused]] const double *q = at.state, *qd = q + " +
           std::to_string(joints_) + ";\n  double* __restrict next = at.state + 4 * " +
           std::to_string(lanes_for(joints_ + slopes_.size())) + ";\n";
  }

  bool is_needed(int node) const { return needed_[static_cast<std::size_t>(node)]; }
  bool varies(int node) const { return node >= 0 && varies_[static_cast<std::size_t>(node)]; }
  std::string name(int node) const { return operand(tape_, node); }

  // Adds the nodes that the recursions of functions also need: the cosine for a sine and vice versa, the
  // square of tanh.
  void add_partners() {
    for (int node : tape_.operations_for(results_)) {
      const Tape::Node given = tape_[node];
      if (given.operation != Operation::function) continue;
      int partner = -1;
      if (tape_.is_turn(node))
        partner = tape_.function(given.name == "sin" ? "cos" : "sin", given.left);
      else if (given.name == "tanh")
        partner = tape_.apply(Operation::multiply, node, node);
      else
        throw std::domain_error("method taylor has no recursion of " + given.name);
      partner_[node] = partner;
      partner_.emplace(partner, node);
      results_.push_back(partner);
    }
  }

  // Nodes that depend on the state or the inputs vary: they have more than one coefficient.
  void classify() {
    needed_ = tape_.needed_by(results_);
    varies_.assign(needed_.size(), 0);
    for (int node = 0; node < tape_.size(); ++node) {
      const Tape::Node& given = tape_[node];
      varies_[static_cast<std::size_t>(node)] = given.operation == Operation::symbol
                                                    ? given.name.rfind("plan.", 0) != 0
                                                    : varies(given.left) || varies(given.right);
    }
  }

  void list_product(int node) {
    const Tape::Node& given = tape_[node];
    if (given.operation == Operation::multiply && varies(given.left) && varies(given.right)) {
      add_product(node, left_[given.left], given.right);
    } else if (given.operation == Operation::divide && varies(given.right)) {
      add_product(node, left_[node], given.right);
      reciprocals_.emplace(node, reciprocals_.size());
    } else if (given.operation == Operation::function) {
      add_product(node, rate_[given.left], partner_.at(node));
    }
  }

  void add_product(int node, std::vector<std::size_t>& left, int right) {
    left.push_back(products_);
    right_[right].push_back(products_);
    product_[node] = products_++;
  }

  // Marks the non-varying nodes that multiply or divide varying ones.
  void mark_factors() {
    factor_.assign(needed_.size(), 0);
    for (int node = tape_.size() - 1; node >= 0; --node) {
      const std::size_t place = static_cast<std::size_t>(node);
      const Operation operation = tape_[node].operation;
      const bool scales = operation == Operation::multiply || operation == Operation::divide;
      if (!factor_[place] && !(scales && is_needed(node) && varies(node))) continue;
      for (int factor : {tape_[node].left, tape_[node].right})
        if (factor >= 0 && !varies(factor)) factor_[static_cast<std::size_t>(factor)] = 1;
    }
  }

  static std::string assigned(const char* array, std::size_t place, const std::string& value) {
    return "  " + indexed(array, place) + " = " + value + ";\n";
  }

  static std::vector<std::size_t> places_of(const Places& places, int node) {
    const auto found = places.find(node);
    return found == places.end() ? std::vector<std::size_t>() : found->second;
  }

  // Stores a value in the arrays from which products read it.
  std::string kept(int node) const {
    std::string text;
    for (std::size_t place : places_of(left_, node)) text += assigned("left", place, name(node));
    for (std::size_t place : places_of(right_, node)) text += assigned("right", place, name(node));
    return text;
  }

  // The same for a coefficient, but by lanes: loading a lane after storing single numbers would stall.
  std::string taken(int node) {
    return stored_lanes("left", left_terms_, left_, node, name(node)) +
           stored_lanes("right", right_terms_, right_, node, name(node));
  }

  // Stores the lanes that this term completes.
  std::string stored_lanes(const char* array, std::vector<std::string>& terms, const Places& places, int node,
                           const std::string& term) {
    std::string text;
    for (std::size_t place : places_of(places, node)) {
      terms[place] = term;
      const auto first = terms.begin() + static_cast<std::ptrdiff_t>(place / 4 * 4);
      if (std::find(first, first + 4, "") == first + 4)
        text += assigned(
            array, place / 4,
            "Lanes<double>::of(" + first[0] + ", " + first[1] + ", " + first[2] + ", " + first[3] + ")");
    }
    return text;
  }

  std::string reciprocal(int node) const {
    const auto found = reciprocals_.find(node);
    return found == reciprocals_.end()
               ? std::string()
               : assigned("reciprocals", found->second, "1.0 / " + name(tape_[node].right));
  }

  std::string declared(int node, const std::string& value) const {
    return "  const double " + name(node) + " = " + value + ";\n";
  }

  // The statements for coefficient `order` of a node.
  std::string term(int node) {
    const Operation operation = tape_[node].operation;
    if (operation == Operation::constant) return {};
    if (!varies(node)) {
      const bool is_used = operation != Operation::symbol && factor_[static_cast<std::size_t>(node)];
      return is_used ? declared(node, arithmetic(tape_, node)) : std::string();
    }
    if (!is_needed(node)) return {};
    if (operation == Operation::symbol) return taken(node);
    if (operation == Operation::function) return function_terms(node);
    return declared(node, coefficient(node)) + taken(node);
  }

  std::string coefficient(int node) const {
    const Tape::Node& given = tape_[node];
    const bool left = varies(given.left), right = varies(given.right);
    const bool multiplies = given.operation == Operation::multiply;
    if (left && right && multiplies)
      return of_product("sums", node) + " + " + of_product("left_0", node) + " * " + name(given.right) +
             " + " + of_product("right_0", node) + " * " + name(given.left);
    if (right && given.operation == Operation::divide)
      return "(" + (left ? name(given.left) : std::string()) + " - " + of_product("sums", node) + " - " +
             of_product("left_0", node) + " * " + name(given.right) + ") * " +
             indexed("at.reciprocals", reciprocals_.at(node));
    if (given.operation == Operation::subtract && !left) return "-" + name(given.right);
    const bool adds = given.operation == Operation::add || given.operation == Operation::subtract;
    if (adds && left != right) return name(left ? given.left : given.right);
    return arithmetic(tape_, node);
  }

  std::string of_product(const char* array, int node) const { return indexed(array, product_.at(node)); }

  // Sine and cosine are written together, at the first of both.
  std::string function_terms(int node) {
    const int argument = tape_[node].left, partner = partner_.at(node);
    const std::string rate = "rate" + std::to_string(argument);
    const auto integral = [&](int of) {
      return "(" + of_product("sums", of) + " + " + rate + " * " + of_product("right_0", of) +
             ") * per_order";
    };
    std::string text;
    if (rates_written_.insert(argument).second)
      text = "  const double " + rate + " = order * " + name(argument) + ";\n" +
             stored_lanes("left", left_terms_, rate_, argument, rate);
    if (!tape_.is_turn(node))
      return text + declared(node, name(argument) + " - " + integral(node)) + taken(node);
    if (!turns_written_.insert(argument).second) return {};
    for (int one : {node, partner})
      text += declared(one, (tape_[one].name == "sin" ? "" : "-") + integral(one)) + taken(one);
    return text;
  }

  Tape tape_;  // of the line, plus partners
  std::size_t joints_;
  std::vector<int> slopes_, results_;  // results_: slopes_ and partners
  std::map<int, int> partner_;
  std::vector<char> needed_, varies_, factor_;
  std::size_t products_ = 0;
  std::map<int, std::size_t> product_, reciprocals_;  // per node
  Places left_, rate_, right_;
  std::vector<std::string> left_terms_, right_terms_;  // padded to full lanes; "": not yet written
  std::set<int> rates_written_, turns_written_;        // arguments
};

}  // namespace

std::string series_definitions(const StraightLine& line) { return SeriesWriter(line).text(); }

}  // namespace redysim
