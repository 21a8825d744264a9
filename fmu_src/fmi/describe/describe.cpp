// Prints a model as JSON for the packager: its variables, units, model structure and drawing.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynamics/straight_line/straight_line.hpp"
#include "fmi/boundary/assembly_messages.hpp"
#include "fmi/boundary/log.hpp"
#include "fmi/describe/drawing.hpp"
#include "fmi/describe/json.hpp"
#include "fmi/instance/contact_warnings.hpp"
#include "fmi/variables/dependencies.hpp"
#include "fmi/variables/drive.hpp"
#include "fmi/variables/parameters.hpp"
#include "fmi/variables/presentation.hpp"
#include "fmi/variables/variables.hpp"
#include "integrate/system/independent_coordinates.hpp"
#include "integrate/system/start.hpp"
#include "model/any_of.hpp"
#include "model/features.hpp"
#include "model/model_exchange.hpp"
#include "model/read/fingerprint.hpp"
#include "model/read/idle_fields.hpp"
#include "model/read/model_file.hpp"
#include "model/solver_methods.hpp"

using namespace redysim;

namespace {

constexpr int json_format = 1;

// The standard requires a C identifier.
std::string identifier(const std::string& name) {
  std::string result;
  for (char c : name) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    const bool digit = c >= '0' && c <= '9';
    if (digit && result.empty()) result += '_';
    result += letter || digit ? c : '_';
  }
  return result.empty() ? "model" : result;
}

// Motion inputs that are not set move a joint at its start velocity.
bool depends_on_time(const Model& model) {
  return !model.trajectories.empty() ||
         any_of(model.links, [](const Link& link) { return link.joint.drive == Drive::motion; });
}

void write_header(Json& json, const ModelFile& file) {
  const Model& model = file.model;
  json.member("format", json_format);
  json.member("model_name", model.name).member("model_identifier", identifier(model.name));
  json.member("description", model.description).member("guid", fingerprint(file.source));
  json.key("resources").begin_array();
  for (const std::string& name : file.attached) json.value(name);
  json.end_array();
  json.member("depends_on_time", depends_on_time(model));
  json.member("generation_tool", "ReDySim-FMU " REDYSIM_VERSION);
  json.key("origin").begin_object();
  for (std::size_t i = 0; i < model.fmu.origin.size(); ++i)
    if (!model.fmu.origin[i].empty()) json.member(FmuSettings::origin_fields[i], model.fmu.origin[i]);
  json.end_object().key("default_experiment").begin_object();
  json.member("start_time", 0).member("stop_time", model.fmu.stop_time);
  json.member("tolerance", model.solver.rtol).member("step_size", model.fmu.step_size).end_object();
}

// Settings of `build-fmu report`.
void write_report(Json& json, const Model& model) {
  json.key("report").begin_object();
  if (!model.report.reference.empty()) json.member("reference", model.report.reference);
  if (model.solver.target_error > 0) json.member("target_error", model.solver.target_error);
  json.end_object();
}

void write_capabilities(Json& json) {
  json.key("capabilities").begin_object();
  json.member("canHandleVariableCommunicationStepSize", true);
  json.member("canInterpolateInputs", true);
  json.member("maxOutputDerivativeOrder", 1);
  json.member("canGetAndSetFMUstate", true);
  json.member("canSerializeFMUstate", true);
  json.member("providesDirectionalDerivative", true);
  json.member("canBeInstantiatedOnlyOncePerProcess", false);
  json.member("canNotUseMemoryManagementFunctions", false);
  json.member("canRunAsynchronuously", false);
  json.member("needsExecutionTool", false).end_object();
}

// Writes the flags of model exchange, or why the model does not support it.
void write_model_exchange(Json& json, const Model& model, const Plan<double>& plan) {
  if (const char* why = objection_to_model_exchange(model)) {
    json.member("no_model_exchange", why);
    return;
  }
  json.key("model_exchange").begin_object();
  json.member("needsExecutionTool", false);
  json.member("completedIntegratorStepNotNeeded", plan.balls.empty() && !plan.has_constraints());
  json.member("canBeInstantiatedOnlyOncePerProcess", false);
  json.member("canNotUseMemoryManagementFunctions", false);
  json.member("canGetAndSetFMUstate", true);
  json.member("canSerializeFMUstate", true);
  json.member("providesDirectionalDerivative", true).end_object();
}

void write_log_categories(Json& json) {
  constexpr const char* descriptions[] = {
      "Every message", "Refused calls and failed steps, with the reason",
      "Doubtful model data and doubtful use of the FMU",
      "Events: start of the solver, choices of the method, reset, end of the simulation"};
  static_assert(std::size(descriptions) == std::size(log_categories));
  json.key("log_categories").begin_array();
  for (std::size_t k = 0; k < std::size(log_categories); ++k)
    json.begin_object().member("name", log_categories[k]).member("description", descriptions[k]).end_object();
  json.end_array();
}

void write_unit(Json& json, const Unit& unit) {
  json.begin_object().member("name", unit.name).key("base").begin_object();
  const std::pair<const char*, int> exponents[] = {
      {"kg", unit.kg}, {"m", unit.m}, {"s", unit.s}, {"A", unit.ampere}, {"rad", unit.rad}};
  for (const auto& [name, exponent] : exponents)
    if (exponent != 0) json.member(name, exponent);
  json.end_object().key("display").begin_array();
  if (unit.display_name)
    json.begin_object().member("name", unit.display_name).member("factor", unit.display_factor).end_object();
  json.end_array().end_object();
}

// Writes each unit once, in the order of first use.
void write_units(Json& json, const Model& model, const VariableTable& table) {
  std::vector<const Unit*> used;
  json.key("units").begin_array();
  for (const Variable& variable : table.all()) {
    const Unit* unit = presentation(model, variable).quantity.unit;
    bool is_new = unit != nullptr;
    for (const Unit* other : used) is_new = is_new && other != unit;
    if (!is_new) continue;
    used.push_back(unit);
    write_unit(json, *unit);
  }
  json.end_array();
}

const char* text(VariableType type) {
  return type == VariableType::real ? "Real" : type == VariableType::integer ? "Integer" : "String";
}

const char* text(Causality causality) {
  switch (causality) {
    case Causality::input:
      return "input";
    case Causality::output:
      return "output";
    case Causality::local:
      return "local";
    default:
      return "parameter";
  }
}

const char* text(Variability variability) {
  switch (variability) {
    case Variability::fixed:
      return "fixed";
    case Variability::tunable:
      return "tunable";
    case Variability::discrete:
      return "discrete";
    default:
      return "continuous";
  }
}

void write_start(Json& json, const Model& model, Parameters<double>& parameters, const Variable& variable) {
  const Words& words = words_of(variable);
  switch (variable.causality()) {
    case Causality::input:
      json.null().member("start", words.start ? words.start(model, variable) : 0);
      break;
    case Causality::output:
    case Causality::local:
      json.value("calculated");
      break;
    case Causality::parameter:
      json.value("exact").key("start");
      if (const double* value = parameter(parameters, variable))
        json.value(*value);
      else
        json.value(method_name(model.solver.method));  // the only String parameter
  }
}

void write_variable(Json& json, const Model& model, Parameters<double>& parameters, const Variable& variable,
                    const Variable* derivative_of, double nominal) {
  json.begin_object().member("name", variable.name).member("value_reference", variable.value_reference);
  json.member("type", text(variable.type())).member("causality", text(variable.causality()));
  json.member("variability", text(variable.variability())).key("initial");
  write_start(json, model, parameters, variable);
  const Presentation shown = presentation(model, variable);
  const Unit* unit = shown.quantity.unit;
  if (unit) json.member("unit", unit->name);
  if (unit && unit->display_name) json.member("display_unit", unit->display_name);
  if (shown.quantity.name) json.member("quantity", shown.quantity.name);
  if (derivative_of) json.member("derivative", derivative_of->name);
  if (nominal != 1) json.member("nominal", nominal);
  if (std::isfinite(variable.min())) json.member("min", variable.min());
  if (std::isfinite(variable.max())) json.member("max", variable.max());
  json.member("description", shown.description).end_object();
}

// Features that `build --specialise` must keep.
void write_features(Json& json, const Model& model) {
  json.key("features").begin_array();
  for (const std::string& feature : features_of(model)) json.value(feature);
  json.end_array();
}

void write_variables(Json& json, const Model& model, const VariableTable& table, const StateVariables& states,
                     const IndependentCoordinates& exchanged) {
  Parameters<double> parameters = parameters_of(model);
  std::vector<const Variable*> derivative_of(table.all().size());
  std::vector<double> nominals(static_cast<std::size_t>(exchanged.size())), nominal(table.all().size(), 1.0);
  exchanged.nominals(nominals.data());
  for (std::size_t place = 0; place < states.states.size(); ++place) {
    derivative_of[states.slopes[place]] = &table.all()[states.states[place]];
    nominal[states.states[place]] = nominals[place];
  }
  json.key("variables").begin_array();
  for (std::size_t k = 0; k < table.all().size(); ++k)
    write_variable(json, model, parameters, table.all()[k], derivative_of[k], nominal[k]);
  json.end_array();
}

// The packager makes their names unique.
void write_arrays(Json& json, const Scene& scene, const VariableTable& table) {
  json.key("arrays").begin_array();
  for (const Variable& first : table.all()) {
    const std::vector<unsigned> elements = table.array(scene, first);
    if (elements.empty()) continue;
    const Row& row = *first.row;
    // "arm.force" of "arm.force[1]", "q" of "elbow.q"
    std::string name = first.name.substr(0, row.is_array() ? first.name.rfind('[') : first.name.npos);
    if (!row.is_array()) name.erase(0, name.rfind('.') + 1);
    const int columns = table.lengths().of(row.columns);
    const int rows = static_cast<int>(elements.size()) / std::max(columns, 1);
    json.begin_object().member("name", name);
    json.member("value_reference", array_reference + first.value_reference);
    const bool state_of_joint = row.owner == Owner::joint && row.has_state();
    json.member("suffix", !state_of_joint                             ? ""
                          : scene.plan.joints[first.joint].prescribed ? "_prescribed"
                          : is_dependent(scene, first)                ? "_dependent"
                          : is_algebraic(scene, first)                ? "_algebraic"
                                                                      : "");
    json.key("dimensions").begin_array().value(rows);
    if (columns > 0) json.value(columns);
    json.end_array().key("elements").begin_array();
    for (const unsigned element : elements) json.value(table.all()[element - 1].name);
    json.end_array().end_object();
  }
  json.end_array();
}

void write_structure(Json& json, const char* key, const VariableTable& table,
                     const std::vector<Dependencies>& rows) {
  json.key(key).begin_array();
  for (const Dependencies& row : rows) {
    json.begin_object().member("name", table.all()[row.unknown].name);
    if (!row.all) {
      json.key("dependencies").begin_array();
      for (int known : row.knowns) json.value(table.all()[known].name);
      json.end_array();
    }
    if (row.constant && !row.all) {
      json.key("kinds").begin_array();
      for (std::size_t i = 0; i < row.knowns.size(); ++i) json.value("constant");
      json.end_array();
    }
    json.end_object();
  }
  json.end_array();
}

Diagnostic at_joint(const Model& model, const Plan<double>& plan, int joint, const std::string& path,
                    const char* where) {
  const Link& link = model.links[plan.joints[joint].link];
  return {path, link.line, link.column, singular_sentence(model, plan, joint, where)};
}

void check_movable(const Model& model, const Plan<double>& plan, const std::string& path) {
  Workspace<double> workspace(plan);
  const int joint = always_singular_joint(plan, workspace);
  if (joint >= 0) throw ModelError(ModelError::Reason::invalid, {at_joint(model, plan, joint, path, "")});
}

void warn_of_contacts(const ModelFile& file, const std::string& path, System& system, const double* y,
                      std::vector<Diagnostic>& warnings) {
  std::vector<double> slope(static_cast<std::size_t>(system.size()));
  if (!system.plan().has_contacts() || system.right_hand_side(0, y, slope.data()) != Status::ok) return;
  for (const ContactWarning& found : contact_warnings(file.model, system.plan(), system.workspace())) {
    const Contact& contact = file.model.contacts[static_cast<std::size_t>(found.contact)];
    warnings.push_back({path, contact.line, contact.column, found.sentence});
  }
}

// The model at the start of the FMU. Corrections by the assembly become warnings; loops that cannot be
// assembled are errors.
Model assembled(const ModelFile& file, const std::string& path, const Plan<double>& plan,
                std::vector<Diagnostic>& warnings) {
  check_movable(file.model, plan, path);
  System system(plan, false, &file.model);
  std::vector<double> y(static_cast<std::size_t>(system.size()));
  begin_motions(file.model, system, 0);
  const Parameters<double> parameters = parameters_of(file.model);
  const auto [assembly, rest] = assemble_start(file.model, parameters, system, 0, y.data());
  if (plan.has_constraints()) {
    const ConstraintPlace at = constraint_at(file.model, assembly.constraint);
    const std::string why = failure(file.model, assembly);
    if (!why.empty()) throw ModelError(ModelError::Reason::invalid, {{path, at.line, at.column, why}});
    for (const std::string& text : corrections(file.model, plan, assembly))
      warnings.push_back({path, at.line, at.column, text});
    const Tangent::Misfit found = misfit_of_accelerations(file.model, parameters, system, 0, y.data());
    if (found.constraint >= 0) {
      const ConstraintPlace of = constraint_at(file.model, found.constraint);
      warnings.push_back(
          {path, of.line, of.column, misfit(file.model, found.constraint, found.acceleration)});
    }
  }
  const std::string no_rest = failure(file.model, plan, rest);
  if (!no_rest.empty()) warnings.push_back({path, 1, 1, no_rest + " (inputs at 0)"});
  const int singular = singular_joint(plan, system.workspace(), system.coordinates(0, y.data()).q);
  if (singular >= 0) warnings.push_back(at_joint(file.model, plan, singular, path, " at the start pose"));
  warn_of_contacts(file, path, system, y.data(), warnings);
  return at_start(file.model, system, 0, y.data());
}

// Returns whether the start is close to a singular configuration of the loops.
bool choose_at_start(const Model& model, const Parameters<double>& parameters, System& system,
                     IndependentCoordinates& exchanged) {
  std::vector<double> y(static_cast<std::size_t>(system.size())), accelerations(system.plan().joints.size());
  begin_motions(model, system, 0);
  assemble_start(model, parameters, system, 0, y.data());
  exchanged.choose(0, y.data());
  system.accelerations(0, y.data(), accelerations.data());
  return system.plan().has_constraints() && system.independent_rows() < exchanged.rank();
}

std::string description(const ModelFile& file, const std::string& path, std::vector<Diagnostic>& warnings) {
  const Plan<double> plan(file.model);
  System system(plan, has_work(file.model, plan), &file.model);
  const Model start = assembled(file, path, plan, warnings);
  const Parameters<double> parameters = parameters_of(start);
  const std::vector<int> independent = independent_joints(start, parameters, system);
  const VariableTable table(file.model, plan, independent);
  IndependentCoordinates exchanged(file.model, system, independent);
  if (choose_at_start(file.model, parameters_of(file.model), system, exchanged))  // as an instance
    warnings.push_back(
        {path, 1, 1,
         "the start is close to a singular configuration of the closed loops, where accelerations "
         "and loop forces may be wrong"});
  Json json;
  json.begin_object();
  write_header(json, file);
  write_report(json, file.model);
  write_capabilities(json);
  write_model_exchange(json, file.model, plan);
  write_log_categories(json);
  write_features(json, file.model);
  write_units(json, file.model, table);
  json.key("event_indicators").begin_array();
  for (const Variable& variable : table.all())
    if (variable.row->is_indicator) json.value(variable.name);
  json.end_array();
  const Scene scene{file.model, plan};
  const StateVariables states = state_variables(table, file.model, system, exchanged);
  write_variables(json, file.model, table, states, exchanged);
  write_arrays(json, scene, table);
  write_structure(json, "outputs", table, output_dependencies(table, scene, states));
  write_structure(json, "derivatives", table, slope_dependencies(table, scene, states));
  write_structure(json, "initial_unknowns", table, initial_dependencies(table, scene));
  json.key("drawing");
  const std::vector<DrawnShape> shapes = read_shapes(path, file.model);
  write_drawing(json, start, shapes);
  json.end_object();
  return json.text() + "\n";
}

// Forward dynamics as straight-line C++ code. Throws std::domain_error if the model has none.
std::string code(const ModelFile& file) {
  const Model& model = file.model;
  const std::vector<std::string> parts = features_of(model);
  const bool controlled = std::any_of(parts.begin(), parts.end(), [](const std::string& part) {
    return part == "control" || part == "actuators";
  });
  if (model.solver.method == SolverMethod::taylor && controlled)
    throw std::domain_error("method taylor is for forces that are inputs, without controllers and actuators");
  const StraightLine line = straight_line(model);
  const int count = operations(line);
  if (count > longest_line(line))
    throw std::domain_error("a straight line of " + std::to_string(count) +
                            " operations is too long, at most " + std::to_string(longest_line(line)) +
                            " are useful");
  return straight_line_source(line, fingerprint(file.source));
}

}  // namespace

int main(int count, char** arguments) {
  const bool as_code = count == 3 && std::strcmp(arguments[1], "--straight-line") == 0;
  const char* path = arguments[count - 1];
  if ((count != 2 && !as_code) || path[0] == '-') {
    std::fputs("usage: describe [--straight-line] MODEL.toml\n", stderr);
    return 2;
  }
  try {
    const ModelFile file = read_model_file(path);
    std::vector<Diagnostic> warnings = file.warnings;
    for (Diagnostic& idle : idle_fields(path, file.model)) warnings.push_back(std::move(idle));
    const std::string text = as_code ? code(file) : description(file, path, warnings);
    for (const Diagnostic& warning : warnings) {
      Diagnostic line = warning;
      if (line.message.rfind("warning: ", 0) != 0) line.message.insert(0, "warning: ");
      std::fprintf(stderr, "%s\n", line.text().c_str());
    }
    if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0) return 0;
    std::fputs("describe: cannot write to standard output\n", stderr);
  } catch (const ModelError& error) {
    for (const Diagnostic& diagnostic : error.diagnostics())
      std::fprintf(stderr, "%s\n", diagnostic.text().c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "describe: %s\n", error.what());
  }
  return 1;
}
