#include "model/read/settings_reader.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "model/read/actuator_reader.hpp"
#include "model/read/joint_parameters.hpp"
#include "model/read/suggest.hpp"
#include "model/solver_methods.hpp"

namespace redysim {
namespace {

// Reason why the motion within a step is not differentiable; null if it is.
const char* objection_to_step_jacobian(const Model& model) {
  if (model.controller.sample_time > 0) return "a sampled controller";
  for (const Contact& contact : model.contacts)
    if (contact.law == Contact::Law::redysim) return "contacts with law = \"redysim\"";
  return nullptr;
}

void read_outputs(Section& section, const Model& model, FmuSettings& fmu) {
  if (!section.has("outputs")) return;
  std::vector<std::string> names;
  for (const OutputGroupRow& row : output_groups) names.push_back(row.name);
  const std::vector<bool> shown = section.flags("outputs", names);
  fmu.outputs = {};
  for (std::size_t k = 0; k < shown.size(); ++k)
    if (shown[k]) fmu.outputs.add(output_groups[k].group);
  const char* objection = objection_to_step_jacobian(model);
  for (const OutputGroup group : {OutputGroup::step_jacobian, OutputGroup::parameter_jacobian})
    if (objection && fmu.shows(group))
      section.error("outputs", std::string("'") + output_groups[static_cast<int>(group)].name +
                                   "' does not exist with " + objection);
}

constexpr const char* settable_state = "state";  // in `tunable`: state.q[i], state.qd[i] ... state.apply

void read_tunable(Section& section, const Model& model, FmuSettings& fmu) {
  const auto names = section.texts("tunable");
  if (names.empty()) return;
  const std::vector<std::string> legal = tunable_names(model);
  const std::set<std::string> known(legal.begin(), legal.end());
  std::set<std::string> listed;
  for (const auto& [name, place] : names) {
    if (known.count(name) == 0)
      section.error(place,
                    "tunable '" + name + "' is not a parameter of this model" + did_you_mean(name, legal));
    else if (!listed.insert(name).second)
      section.error(place, "tunable lists '" + name + "' twice");
    else if (name == settable_state)
      fmu.outputs.add(OutputGroup::state);
    else
      fmu.tunable.push_back(name);
  }
}

void add_indexed(std::vector<std::string>& names, const std::string& array, int size) {
  for (int i = 1; i <= size; ++i) names.push_back(array + "[" + std::to_string(i) + "]");
}

void add_actuator_numbers(std::vector<std::string>& names, const Model& model) {
  for (const Actuator& actuator : model.actuators)
    for (const ActuatorNumber& number : actuator_numbers)
      if ((actuator.*number.there)())
        names.push_back(model.links[actuator.link].joint.name + "." + number.name);
}

}  // namespace

std::vector<std::string> tunable_names(const Model& model) {
  std::vector<std::string> names;
  for (const Link& link : model.links) {
    // "hand[2]" is a DOF of a compound joint and has no body; "hand[z]" is part of a Ball
    const std::size_t bracket = link.name.find('[');
    if (bracket == std::string::npos) {
      names.push_back(link.name + ".mass");
      add_indexed(names, link.name + ".com", 3);
      add_indexed(names, link.name + ".inertia", 6);
    } else if (link.name[bracket + 1] < '0' || link.name[bracket + 1] > '9') {
      continue;
    }
    if (!moves(link.joint)) continue;
    for (const JointParameter& parameter : joint_parameters)
      if (parameter.tunable && std::isfinite(link.joint.*parameter.value))
        names.push_back(link.joint.name + "." + parameter.name);
  }
  for (const ControlledJoint& controlled : model.controller.joints)
    for (const char* parameter : {".kp", ".kd", ".target"})
      names.push_back(model.links[controlled.link].joint.name + parameter);
  add_actuator_numbers(names, model);
  for (const Contact& contact : model.contacts) {
    names.push_back(contact.name + ".stiffness");
    names.push_back(contact.name + ".friction");
    if (contact.law == Contact::Law::redysim) continue;
    for (const char* parameter : {".damping", ".static_friction", ".friction_velocity"})
      names.push_back(contact.name + parameter);
  }
  add_indexed(names, "gravity", 3);
  names.push_back(settable_state);
  return names;
}

SolverSettings read_solver(Section& top, Findings& findings) {
  SolverSettings solver;
  const Value* table = top.table("solver");
  if (!table) return solver;
  Section section(*table, "solver", findings);
  solver.method = section.choice<SolverMethod>("method", solver_methods, SolverMethod::automatic);
  solver.rtol = section.number("rtol", solver.rtol, Bound::positive);
  if (solver.rtol > 0.1) section.error("rtol", "rtol must be <= 0.1, got " + shown(solver.rtol));
  solver.atol = section.number("atol", solver.rtol / 100, Bound::not_negative);
  solver.max_step = section.number("max_step", 0, Bound::not_negative);
  solver.max_rhs = section.number("max_rhs", 0, Bound::not_negative);
  if (const std::string why = objection_to_max_rhs(solver); !why.empty()) section.error("max_rhs", why);
  solver.target_error = section.number("target_error", 0, Bound::positive);
  if (section.has("rtol")) solver.target_error = 0;  // a given rtol has priority
  section.refuse_unknown();
  return solver;
}

ReportSettings read_report(Section& top, Findings& findings) {
  ReportSettings report;
  const Value* table = top.table("report");
  if (!table) return report;
  Section section(*table, "report", findings);
  report.reference = section.text("reference");
  section.refuse_unknown();
  return report;
}

FmuSettings read_fmu(Section& top, const Model& model, Findings& findings) {
  FmuSettings fmu;
  const Value* table = top.table("fmu");
  if (!table) return fmu;
  Section section(*table, "fmu", findings);
  read_outputs(section, model, fmu);
  read_tunable(section, model, fmu);
  fmu.stop_time = section.number("stop_time", fmu.stop_time, Bound::positive);
  fmu.step_size = section.number("step_size", fmu.step_size, Bound::positive);
  for (const char* field : FmuSettings::origin_fields) fmu.origin.push_back(section.text(field));
  section.refuse_unknown();
  return fmu;
}

}  // namespace redysim
