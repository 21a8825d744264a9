#include "dynamics/straight_line/straight_line.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "dynamics/aba.hpp"
#include "dynamics/energy.hpp"
#include "dynamics/straight_line/composite_dynamics.hpp"
#include "dynamics/straight_line/series_statements.hpp"
#include "dynamics/straight_line/statement_order.hpp"
#include "dynamics/straight_line/statements.hpp"
#include "math/recorded.hpp"

namespace redysim {
namespace {

// The plan whose tunable parameters are symbols for entries of the plan of doubles.
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

// Records one of the two algorithms for the accelerations.
StraightLine recorded(const Model& model, bool by_composites) {
  StraightLine line;
  line.by_composites = by_composites;
  const TunablePlan tunable(line.tape, model);
  const Plan<Recorded>& plan = tunable.plan();
  if (!plan.ports.empty() || plan.prescribed_count > 0)
    throw std::domain_error("a straight line is for joints driven by forces, without forces at frames");
  Workspace<Recorded> ws(plan);
  const std::vector<Recorded> q = symbols(line.tape, "q", plan.nv), qd = symbols(line.tape, "qd", plan.nv),
                              tau = symbols(line.tape, "tau", plan.nv);
  std::vector<Recorded> qdd(q.size());
  if (by_composites)
    composite_forward_dynamics(with_base_parameters(plan, ws, q.data()), ws, q.data(), qd.data(), tau.data(),
                               qdd.data());
  else
    forward_dynamics(plan, ws, q.data(), qd.data(), tau.data(), qdd.data());
  for (const Recorded& one : qdd) line.qdd.push_back(one.node_on(line.tape));
  line.has_series = uses_series(model);
  if (line.has_series && model.fmu.shows(OutputGroup::energy))
    line.power = {external_power(plan, ws, q.data(), qd.data(), tau.data()).node_on(line.tape)};
  return line;
}

}  // namespace

StraightLine straight_line(const Model& model) {
  if (!model.loops.empty() || !model.couplings.empty() || !model.springs.empty() || !model.bushings.empty() ||
      !model.contacts.empty() || !model.balls.empty())
    throw std::domain_error(
        "a straight line is for open trees without spring-dampers, bushings, contacts and spherical joints");
  StraightLine recursion = recorded(model, false), composites = recorded(model, true);
  return operations(composites) < operations(recursion) ? composites : recursion;
}

int operations(const StraightLine& line) {
  return static_cast<int>(line.tape.operations_for(line.qdd).size());
}

int longest_line(const StraightLine& line) {
  constexpr std::size_t of_few_joints = 3000, each = 280;
  const std::size_t most = line.has_series ? 5000 : 20000;
  return static_cast<int>(std::clamp(each * line.qdd.size(), of_few_joints, most));
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
      scene +
      "\";\n\n"
      "REDYSIM_CLONES void straight_line_forward_dynamics([[maybe_unused]] const Plan<double>& plan, "
      "const double* q,\n"
      "    const double* qd, const double* tau, double* qdd) {\n" +
      value_statements(line.tape, line.qdd, statement_order(line.tape, line.qdd, line.by_composites),
                       [](int) { return std::string(); });
  for (std::size_t i = 0; i < line.qdd.size(); ++i)
    text += "  " + indexed("qdd", i) + " = " + operand(line.tape, line.qdd[i]) + ";\n";
  text += "}\n";
  if (line.has_series) text += series_definitions(line);
  return text + "\n}  // namespace redysim\n";
}

}  // namespace redysim
