#include "dynamics/straight_line/statements.hpp"

#include <cstdio>

namespace redysim {
namespace {

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, value < 0 ? "(%.17g)" : "%.17g", value);
  std::string result = text;
  if (result.find_first_of(".en") == std::string::npos)
    result.insert(result.size() - (value < 0 ? 1 : 0), ".0");
  return result;
}

class ValueWriter {
 public:
  ValueWriter(const Tape& tape, const std::vector<int>& results, const std::vector<int>& order,
              const std::function<std::string(int)>& after)
      : tape_(tape),
        after_(after),
        needed_(tape.needed_by(results)),
        written_(needed_.size(), 0),
        lane_of_(needed_.size(), -1) {
    write_angles();
    for (int node : order) write(node);
  }
  const std::string& text() const { return text_; }

 private:
  using Operation = Tape::Operation;

  // sines and cosines first, four angles at a time
  void write_angles() {
    std::vector<int> angles;
    for (int node = 0; node < tape_.size(); ++node) {
      if (!needed_[static_cast<std::size_t>(node)] || !tape_.is_turn(node)) continue;
      int& lane = lane_of_[static_cast<std::size_t>(tape_[node].left)];
      if (lane >= 0) continue;
      lane = static_cast<int>(angles.size());
      angles.push_back(tape_[node].left);
    }
    for (std::size_t first = 0; first < angles.size(); first += 4) {
      std::string four;
      for (std::size_t k = first; k < first + 4; ++k) {
        if (k < angles.size()) write(angles[k]);
        four +=
            (k > first ? ", " : "") + (k < angles.size() ? operand(tape_, angles[k]) : std::string("0.0"));
      }
      text_ += "  const SinCos<double> turn" + std::to_string(first / 4) + " = sin_cos(Lanes<double>::of(" +
               four + "));\n";
    }
  }

  void write(int node) {
    const std::size_t place = static_cast<std::size_t>(node);
    const Tape::Node& given = tape_[node];
    if (!needed_[place] || written_[place]) return;
    written_[place] = 1;
    if (given.operation == Operation::constant) return;
    if (given.operation != Operation::symbol) {
      // angles are already written
      for (int before : {given.left, given.right})
        if (before >= 0) write(before);
      text_ += "  const double " + operand(tape_, node) + " = " + expression(node) + ";\n";
    }
    text_ += after_(node);
  }

  std::string expression(int node) const {
    const Tape::Node& given = tape_[node];
    if (given.operation != Operation::function) return arithmetic(tape_, node);
    if (!tape_.is_turn(node)) return "std::" + given.name + "(" + operand(tape_, given.left) + ")";
    const int lane = lane_of_[static_cast<std::size_t>(given.left)];
    return "turn" + std::to_string(lane / 4) + (given.name == "sin" ? ".sine[" : ".cosine[") +
           std::to_string(lane % 4) + "]";
  }

  const Tape& tape_;
  const std::function<std::string(int)>& after_;
  std::vector<char> needed_, written_;
  std::vector<int> lane_of_;  // per angle: its index among all angles
  std::string text_;
};

}  // namespace

std::string indexed(const char* name, std::size_t index) {
  return std::string(name) + "[" + std::to_string(index) + "]";
}

std::string operand(const Tape& tape, int node) {
  const Tape::Node& given = tape[node];
  if (given.operation == Tape::Operation::constant) return number(given.value);
  if (given.operation == Tape::Operation::symbol) return given.name;
  return "v" + std::to_string(node);
}

std::string arithmetic(const Tape& tape, int node) {
  const Tape::Node& given = tape[node];
  const std::string left = operand(tape, given.left);
  switch (given.operation) {
    case Tape::Operation::add:
      return left + " + " + operand(tape, given.right);
    case Tape::Operation::subtract:
      return left + " - " + operand(tape, given.right);
    case Tape::Operation::multiply:
      return left + " * " + operand(tape, given.right);
    case Tape::Operation::divide:
      return left + " / " + operand(tape, given.right);
    default:
      return "-" + left;
  }
}

std::string value_statements(const Tape& tape, const std::vector<int>& results, const std::vector<int>& order,
                             const std::function<std::string(int)>& after) {
  return ValueWriter(tape, results, order, after).text();
}

}  // namespace redysim
