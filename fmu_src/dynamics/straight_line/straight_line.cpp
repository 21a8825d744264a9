#include "dynamics/straight_line/straight_line.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <stdexcept>
#include <utility>

#include "dynamics/aba.hpp"
#include "dynamics/ball.hpp"
#include "dynamics/energy.hpp"
#include "dynamics/straight_line/composite_dynamics.hpp"
#include "dynamics/straight_line/constrained_dynamics.hpp"
#include "dynamics/straight_line/series_statements.hpp"
#include "dynamics/straight_line/statement_order.hpp"
#include "dynamics/straight_line/statements.hpp"
#include "math/recorded.hpp"

namespace redysim {
namespace {

// The plan whose tunable parameters are symbols for entries of the plan of doubles. Without series it has no
// friction and no stops: their forces are part of tau.
class TunablePlan {
 public:
  TunablePlan(Tape& tape, const Model& model)
      : tape_(tape), plan_(model), forces_left_out_(!uses_series(model)) {
    if (forces_left_out_) leave_out_resistances();
    for (const std::string& name : model.fmu.tunable)
      if (!tune_gravity(name) && !tune_link(model, name) && !tune_joint(model, name))
        throw std::domain_error("'" + name + "' is tunable and has no place in a straight line");
    for (auto& joint : plan_.joints) joint.rigid = articulated(joint.inertia);
  }
  const Plan<Recorded>& plan() const { return plan_; }
  const std::map<std::string, double>& values() const { return values_; }  // of the symbols in the model

 private:
  void make_symbol(Recorded& entry, const std::string& place) {
    if (!entry.is_constant()) return;
    values_["plan." + place] = value_of(entry);
    entry = {tape_, tape_.symbol("plan." + place)};
  }

  void leave_out_resistances() {
    for (JointPlan<Recorded>& joint : plan_.joints) {
      joint.has_resistance = joint.has_friction = joint.has_stops = false;
      joint.has_passive_force = joint.stiffness != Recorded(0) || joint.damping != Recorded(0);
    }
  }

  bool tune_gravity(const std::string& name) {
    if (name.rfind("gravity", 0) != 0) return false;
    for (int axis = 0; axis < 3; ++axis) make_symbol(plan_.gravity[axis], indexed("gravity", axis));
    return true;
  }

  // Not every name with the link's name as prefix is inertial: a joint may have the same name.
  static bool is_inertial(const std::string& name, const std::string& link) {
    if (name.rfind(link + ".", 0) != 0) return false;
    const std::string parameter = name.substr(link.size() + 1, name.find('[') - link.size() - 1);
    return parameter == "mass" || parameter == "com" || parameter == "inertia";
  }

  bool tune_link(const Model& model, const std::string& name) {
    for (std::size_t i = 0; i < model.links.size(); ++i) {
      if (!is_inertial(name, model.links[i].name)) continue;
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

  // Whether it is a parameter of the joint that acts on tau only.
  static bool is_of_force(const std::string& name, const std::string& joint) {
    constexpr const char* words[] = {"friction",     "static_friction", "friction_velocity",
                                     "lower",        "upper",           "stop_stiffness",
                                     "stop_damping", "stop_width",      "kp",
                                     "kd",           "target"};
    return std::any_of(std::begin(words), std::end(words),
                       [&](const char* word) { return name == joint + "." + word; });
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
      if (forces_left_out_ && is_of_force(name, owner)) return true;
    }
    return false;
  }

  Tape& tape_;
  Plan<Recorded> plan_;
  bool forces_left_out_;
  std::map<std::string, double> values_;
};

std::vector<Recorded> symbols(Tape& tape, const char* name, int count) {
  std::vector<Recorded> list;
  for (int i = 0; i < count; ++i)
    list.push_back({tape, tape.symbol(indexed(name, static_cast<std::size_t>(i)))});
  return list;
}

// Whether an output contains the work of prescribed joint i.
bool works(const Plan<Recorded>& plan, const Model& model, int i) {
  return plan.joints[i].prescribed && !plan.joints[i].of_ball && model.fmu.shows(OutputGroup::energy);
}

// Accelerations of all joints, and the drive forces of prescribed joints that work.
struct RecordedMotion {
  std::vector<Recorded> qdd, drive;
};

// Records composite bodies, with the rows of loops and couplings.
RecordedMotion record_composites(StraightLine& line, const Model& model, const Plan<Recorded>& given,
                                 Workspace<Recorded>& ws, const Recorded* q, const Recorded* qd,
                                 const Recorded* inputs) {
  const Plan<Recorded> plan = with_base_parameters(given, ws, q);
  const TreeEquations tree(plan, ws, q, qd, inputs);
  const JointRows rows(plan, ws, tree, q, qd, inputs);
  const JointRowFactor factor(tree, rows);
  const auto place = [&line](const auto& values, std::vector<int>& nodes) {
    for (const Recorded& value : values) nodes.push_back(value.node_on(line.tape));
  };
  place(factor.margins(), line.margins);
  place(factor.corrections().transpose().reshaped(), line.corrections);
  place(rows.residual, line.residual);
  place(rows.rate, line.rate);
  place(rows.residual_size, line.residual_size);
  place(rows.rate_size, line.rate_size);
  const JointRowFactor::Motion motion = factor.motion(inputs);
  RecordedMotion result{motion.qdd, std::vector<Recorded>(motion.qdd.size())};
  for (int i = 0; i < plan.nv; ++i) {
    if (plan.joints[i].prescribed) result.qdd[i] = inputs[i];
    if (works(plan, model, i)) result.drive[i] = factor.prescribed_force(motion, i);
  }
  return result;
}

RecordedMotion record_recursion(const Model& model, const Plan<Recorded>& plan, Workspace<Recorded>& ws,
                                const Recorded* q, const Recorded* qd, const Recorded* inputs) {
  RecordedMotion result{std::vector<Recorded>(plan.joints.size()), std::vector<Recorded>(plan.joints.size())};
  forward_dynamics(plan, ws, q, qd, inputs, result.qdd.data());
  for (int i = 0; i < plan.nv; ++i)
    if (works(plan, model, i)) result.drive[i] = prescribed_force(plan, ws, i, q, qd, result.qdd.data());
  return result;
}

// Throws if a row may depend on others at the start: the line would then rarely be used.
void require_independent_rows(const StraightLine& line, const Model& model, const Plan<Recorded>& plan,
                              std::map<std::string, double> symbols) {
  const auto set = [&symbols](int joint, double q) {
    symbols[indexed("q", static_cast<std::size_t>(joint))] = q;
  };
  for (int i = 0; i < plan.nv; ++i) set(i, model.links[plan.joints[i].link].joint.q0);
  for (std::size_t ball = 0; ball < plan.balls.size(); ++ball) {
    const BallAngles start = ball_angles(rotation_of(model.balls[ball].quaternion.data()));
    for (int k = 0; k < 4; ++k) set(plan.balls[ball] + k, joint_positions(start)[k]);
  }
  for (double margin : line.tape.values(line.margins, symbols))
    if (!(margin > 0))
      throw std::domain_error("the rows of loops and couplings are dependent at the start, or nearly so");
}

// Records one of the two algorithms for the accelerations.
StraightLine recorded(const Model& model, bool by_composites) {
  StraightLine line;
  line.by_composites = by_composites;
  const TunablePlan tunable(line.tape, model);
  const Plan<Recorded>& plan = tunable.plan();
  line.has_series = uses_series(model);
  if (line.has_series && !plan.is_plain())
    throw std::domain_error(
        "Taylor series are for open trees of revolute, prismatic and screw joints without prescribed motion, "
        "forces between bodies or at frames");
  Workspace<Recorded> ws(plan);
  const std::vector<Recorded> q = symbols(line.tape, "q", plan.nv);
  std::vector<Recorded> qd = symbols(line.tape, "qd", plan.nv),
                        tau = symbols(line.tape, "tau", InputLayout(plan).recursion_size());
  for (int chart : plan.balls) qd[chart] = tau[chart] = 0;  // does not move
  const RecordedMotion motion =
      by_composites ? record_composites(line, model, plan, ws, q.data(), qd.data(), tau.data())
                    : record_recursion(model, plan, ws, q.data(), qd.data(), tau.data());
  require_independent_rows(line, model, plan, tunable.values());
  for (const Recorded& one : motion.qdd) line.qdd.push_back(one.node_on(line.tape));
  if (plan.prescribed_count > static_cast<int>(plan.balls.size()))
    for (const Recorded& one : motion.drive) line.drive.push_back(one.node_on(line.tape));
  if (line.has_series && model.fmu.shows(OutputGroup::energy))
    line.power = {external_power(plan, ws, q.data(), qd.data(), tau.data()).node_on(line.tape)};
  return line;
}

using Results = std::vector<std::pair<const char*, const std::vector<int>*>>;

// A function of the generated code that sets the results, with their names. If it `decides`, it returns
// whether all margins are positive.
std::string function(const StraightLine& line, const std::string& declaration, const Results& results,
                     bool decides) {
  std::vector<int> nodes;
  if (decides) nodes = line.margins;
  for (const auto& [name, list] : results) nodes.insert(nodes.end(), list->begin(), list->end());
  const std::vector<int> order = statement_order(line.tape, nodes, line.by_composites);
  std::string text = "REDYSIM_CLONES " + declaration + " {\n" +
                     value_statements(line.tape, nodes, order, [](int) { return std::string(); });
  for (const auto& [name, list] : results)
    for (std::size_t i = 0; i < list->size(); ++i)
      text += "  " + indexed(name, i) + " = " + operand(line.tape, (*list)[i]) + ";\n";
  if (decides) {
    text += "  return true";
    for (int margin : line.margins) text += " && " + operand(line.tape, margin) + " > 0";
    text += ";\n";
  }
  return text + "}\n\n";
}

std::string constraint_functions(const StraightLine& line) {
  return function(line,
                  "bool straight_line_corrections([[maybe_unused]] const Plan<double>& plan,\n"
                  "    const double* q, double* C)",
                  {{"C", &line.corrections}}, true) +
         function(line,
                  "void straight_line_residuals([[maybe_unused]] const Plan<double>& plan,\n"
                  "    const double* q, const double* qd, LoopState<double>& loop)",
                  {{"loop.residual", &line.residual},
                   {"loop.rate", &line.rate},
                   {"loop.residual_size", &line.residual_size},
                   {"loop.rate_size", &line.rate_size}},
                  false);
}

}  // namespace

StraightLine straight_line(const Model& model) {
  if (!model.bushings.empty() || !model.contacts.empty())
    throw std::domain_error("a straight line is for models without bushings and contacts");
  StraightLine composites = recorded(model, true);
  if (model.has_constraints()) return composites;
  StraightLine recursion = recorded(model, false);
  return operations(composites) < operations(recursion) ? composites : recursion;
}

int operations(const StraightLine& line) {
  std::vector<int> results(line.qdd);
  for (const auto* more : {&line.drive, &line.margins, &line.corrections, &line.residual, &line.rate,
                           &line.residual_size, &line.rate_size})
    results.insert(results.end(), more->begin(), more->end());
  return static_cast<int>(line.tape.operations_for(results).size());
}

int longest_line(const StraightLine& line) {
  constexpr int of_few_joints = 3000, of_each_joint = 280, of_loops = 25000, of_series = 5000;
  if (!line.residual.empty()) return of_loops;
  const int of_joints = std::max(of_few_joints, of_each_joint * static_cast<int>(line.qdd.size()));
  return std::min(of_joints, line.has_series ? of_series : of_loops);
}

std::string straight_line_source(const StraightLine& line, const std::string& scene) {
  std::string text =
      "// Written by describe --straight-line: forward dynamics of one scene.\n"
      "#include <cmath>\n\n"
      "#include \"dynamics/clones.hpp\"\n#include \"dynamics/straight_line/taylor_series.hpp\"\n#include "
      "\"dynamics/straight_line/straight_line.hpp\"\n#include "
      "\"math/sin_cos.hpp\"\n\n"
      "namespace redysim {\n\n"
      "const char straight_line_scene[] = \"" +
      scene + "\";\n\n" +
      function(line,
               "bool straight_line_forward_dynamics([[maybe_unused]] const Plan<double>& plan,\n"
               "    const double* q, const double* qd, const double* tau, double* qdd, [[maybe_unused]] "
               "double* drive)",
               {{"qdd", &line.qdd}, {"drive", &line.drive}}, true);
  if (!line.residual.empty()) text += constraint_functions(line);
  if (line.has_series) text += series_definitions(line);
  return text + "\n}  // namespace redysim\n";
}

}  // namespace redysim
