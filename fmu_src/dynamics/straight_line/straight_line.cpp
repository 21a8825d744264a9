#include "dynamics/straight_line/straight_line.hpp"

#include <cstdio>
#include <stdexcept>
#include <utility>

#include "dynamics/aba.hpp"
#include "math/recorded.hpp"

namespace redysim {
namespace {

std::string indexed(const char* name, std::size_t index) {
  return std::string(name) + "[" + std::to_string(index) + "]";
}

// The plan with tunable parameters as symbols for entries of the plan of doubles.
class TunablePlan {
 public:
  TunablePlan(Tape& tape, const Model& model) : tape_(tape), plan_(model) {
    for (const std::string& name : model.fmu.tunable)
      if (!tune_gravity(name) && !tune_link(model, name) && !tune_joint(model, name))
        throw std::domain_error("'" + name + "' is tunable and has no place in a straight line");
    for (auto& joint : plan_.joints) joint.rigid = articulated(joint.inertia);
  }
  const Plan<Recorded>& plan() const { return plan_; }

 private:
  void make_symbol(Recorded& entry, const std::string& place) {
    entry = {tape_, tape_.symbol("plan." + place)};
  }

  bool tune_gravity(const std::string& name) {
    if (name.rfind("gravity", 0) != 0) return false;
    for (int axis = 0; axis < 3; ++axis) make_symbol(plan_.gravity[axis], indexed("gravity", axis));
    return true;
  }

  bool tune_link(const Model& model, const std::string& name) {
    for (std::size_t i = 0; i < model.links.size(); ++i) {
      if (name.rfind(model.links[i].name + ".", 0) != 0) continue;
      const int carrier = plan_.carrier[i];
      if (carrier == ground) return true;
      const std::string place = indexed("joints", carrier) + ".inertia.";
      RigidInertia<Recorded>& body = plan_.joints[carrier].inertia;
      make_symbol(body.mass, place + "mass");
      for (int axis = 0; axis < 3; ++axis) make_symbol(body.h[axis], place + indexed("h", axis));
      Symmetric3<Recorded>& I = body.inertia;
      make_symbol(I.xx, place + "inertia.xx");
      make_symbol(I.yy, place + "inertia.yy");
      make_symbol(I.zz, place + "inertia.zz");
      make_symbol(I.xy, place + "inertia.xy");
      make_symbol(I.xz, place + "inertia.xz");
      make_symbol(I.yz, place + "inertia.yz");
      return true;
    }
    return false;
  }

  bool tune_joint(const Model& model, const std::string& name) {
    for (std::size_t i = 0; i < plan_.joints.size(); ++i) {
      JointPlan<Recorded>& joint = plan_.joints[i];
      const std::string& owner = model.links[joint.link].joint.name;
      const std::pair<const char*, Recorded*> entries[] = {{"stiffness", &joint.stiffness},
                                                           {"rest", &joint.rest},
                                                           {"damping", &joint.damping},
                                                           {"armature", &joint.armature}};
      for (const auto& [word, entry] : entries) {
        if (name != owner + "." + word) continue;
        make_symbol(*entry, indexed("joints", i) + "." + word);
        joint.has_passive_force = true;
        if (entry == &joint.armature) joint.axis_free = false;
        return true;
      }
    }
    return false;
  }

  Tape& tape_;
  Plan<Recorded> plan_;
};

std::vector<Recorded> symbols(Tape& tape, const char* name, int count) {
  std::vector<Recorded> list;
  for (int i = 0; i < count; ++i)
    list.push_back({tape, tape.symbol(indexed(name, static_cast<std::size_t>(i)))});
  return list;
}

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, value < 0 ? "(%.17g)" : "%.17g", value);
  std::string result = text;
  if (result.find_first_of(".en") == std::string::npos)
    result.insert(result.size() - (value < 0 ? 1 : 0), ".0");
  return result;
}

// Writes the required nodes of one tape as statements.
class Writer {
 public:
  explicit Writer(const StraightLine& line) : tape_(line.tape), needed_(tape_.needed_by(line.qdd)) {
    write_angles();
    for (int node = 0; node < tape_.size(); ++node) write(node);
    for (std::size_t i = 0; i < line.qdd.size(); ++i)
      text_ += "  " + indexed("qdd", i) + " = " + value(line.qdd[i]) + ";\n";
  }
  const std::string& text() const { return text_; }

 private:
  using Operation = Tape::Operation;

  static bool is_turn(const Tape::Node& node) {
    return node.operation == Operation::function && (node.name == "sin" || node.name == "cos");
  }

  // sines and cosines first, four angles at a time
  void write_angles() {
    std::vector<int> angles;
    std::vector<char> listed(static_cast<std::size_t>(tape_.size()), 0);
    for (int node = 0; node < tape_.size(); ++node) {
      if (!needed_[static_cast<std::size_t>(node)] || !is_turn(tape_[node])) continue;
      const int angle = tape_[node].left;
      if (!listed[static_cast<std::size_t>(angle)]) angles.push_back(angle);
      listed[static_cast<std::size_t>(angle)] = 1;
    }
    lane_of_.assign(static_cast<std::size_t>(tape_.size()), -1);
    written_.assign(static_cast<std::size_t>(tape_.size()), 0);
    for (std::size_t first = 0; first < angles.size(); first += 4) {
      std::string four;
      for (std::size_t k = first; k < first + 4; ++k) {
        if (k < angles.size()) {
          write(angles[k]);
          lane_of_[static_cast<std::size_t>(angles[k])] = static_cast<int>(k);
        }
        four += (k > first ? ", " : "") + (k < angles.size() ? value(angles[k]) : std::string("0.0"));
      }
      text_ += "  const SinCos<double> turn" + std::to_string(first / 4) + " = sin_cos(Lanes<double>::of(" +
               four + "));\n";
    }
  }

  std::string value(int node) const {
    const Tape::Node& given = tape_[node];
    if (given.operation == Operation::constant) return number(given.value);
    if (given.operation == Operation::symbol) return given.name;
    return "v" + std::to_string(node);
  }

  void write(int node) {
    const std::size_t place = static_cast<std::size_t>(node);
    const Tape::Node& given = tape_[node];
    if (!needed_[place] || written_[place]) return;
    written_[place] = 1;
    if (given.operation == Operation::constant || given.operation == Operation::symbol) return;
    // angles are already written
    for (int operand : {given.left, given.right})
      if (operand >= 0) write(operand);
    text_ += "  const double v" + std::to_string(node) + " = " + expression(given) + ";\n";
  }

  std::string expression(const Tape::Node& node) const {
    switch (node.operation) {
      case Operation::add:
        return value(node.left) + " + " + value(node.right);
      case Operation::subtract:
        return value(node.left) + " - " + value(node.right);
      case Operation::multiply:
        return value(node.left) + " * " + value(node.right);
      case Operation::divide:
        return value(node.left) + " / " + value(node.right);
      case Operation::negate:
        return "-" + value(node.left);
      default:
        break;
    }
    if (!is_turn(node)) return "std::" + node.name + "(" + value(node.left) + ")";
    const int lane = lane_of_[static_cast<std::size_t>(node.left)];
    return "turn" + std::to_string(lane / 4) + (node.name == "sin" ? ".sine[" : ".cosine[") +
           std::to_string(lane % 4) + "]";
  }

  const Tape& tape_;
  std::vector<char> needed_, written_;
  std::vector<int> lane_of_;  // of an angle: its place among all angles
  std::string text_;
};

}  // namespace

StraightLine straight_line(const Model& model) {
  if (!model.loops.empty() || !model.couplings.empty() || !model.springs.empty() || !model.bushings.empty() ||
      !model.contacts.empty() || !model.balls.empty())
    throw std::domain_error(
        "a straight line is for open trees without spring-dampers, bushings, contacts and spherical joints");
  StraightLine line;
  const TunablePlan tunable(line.tape, model);
  const Plan<Recorded>& plan = tunable.plan();
  if (!plan.ports.empty() || plan.prescribed_count > 0)
    throw std::domain_error("a straight line is for joints driven by forces, without forces at frames");
  Workspace<Recorded> ws(plan);
  const std::vector<Recorded> q = symbols(line.tape, "q", plan.nv), qd = symbols(line.tape, "qd", plan.nv),
                              tau = symbols(line.tape, "tau", plan.nv);
  std::vector<Recorded> qdd(q.size());
  forward_dynamics(plan, ws, q.data(), qd.data(), tau.data(), qdd.data());
  for (const Recorded& one : qdd) line.qdd.push_back(one.node_on(line.tape));
  return line;
}

int operations(const StraightLine& line) {
  const std::vector<char> needed = line.tape.needed_by(line.qdd);
  int count = 0;
  for (int node = 0; node < line.tape.size(); ++node) {
    const Tape::Operation operation = line.tape[node].operation;
    if (needed[static_cast<std::size_t>(node)] && operation != Tape::Operation::constant &&
        operation != Tape::Operation::symbol)
      ++count;
  }
  return count;
}

std::string straight_line_source(const StraightLine& line, const std::string& scene) {
  return "// Written by describe --straight-line: forward dynamics of one scene.\n"
         "#include <cmath>\n\n"
         "#include \"dynamics/clones.hpp\"\n#include \"dynamics/straight_line/straight_line.hpp\"\n#include "
         "\"math/sin_cos.hpp\"\n\n"
         "namespace redysim {\n\n"
         "const char straight_line_scene[] = \"" +
         scene +
         "\";\n\n"
         "REDYSIM_CLONES void straight_line_forward_dynamics([[maybe_unused]] const Plan<double>& plan, "
         "const double* q,\n"
         "    const double* qd, const double* tau, double* qdd) {\n" +
         Writer(line).text() + "}\n\n}  // namespace redysim\n";
}

}  // namespace redysim
