#include "model/features.hpp"

#include <algorithm>

namespace redysim {
namespace {

struct Feature {
  const char* name;
  bool built_in;
  bool (*used)(const Model&);
};

bool uses_method(const Model& model, SolverMethod method) {
  const SolverMethod chosen = model.solver.method;
  return chosen == method || chosen == SolverMethod::automatic;
}

bool has_coupling(const Model& model, bool rigid) {
  return std::any_of(model.couplings.begin(), model.couplings.end(),
                     [rigid](const Coupling& coupling) { return coupling.rigid() == rigid; });
}

constexpr Feature all_features[] = {
    {"loops", features::loops,
     [](const Model& model) { return !model.loops.empty() || has_coupling(model, true); }},
    {"springs", features::springs,
     [](const Model& model) { return !model.springs.empty() || has_coupling(model, false); }},
    {"bushings", features::bushings, [](const Model& model) { return !model.bushings.empty(); }},
    {"contact", features::contact, [](const Model& model) { return !model.contacts.empty(); }},
    {"friction", features::friction, may_resist},
    {"ports", features::ports,
     [](const Model& model) {
       return std::any_of(model.frames.begin(), model.frames.end(),
                          [](const Frame& frame) { return frame.port != Frame::Port::none; });
     }},
    {"motion", features::motion,
     [](const Model& model) {
       return std::any_of(model.links.begin(), model.links.end(),
                          [](const Link& link) {
                            return link.joint.drive == Drive::motion || link.joint.drive == Drive::locked;
                          }) ||
              model.controller.law == Law::computed_torque ||
              model.controller.law == Law::gravity_compensation;
     }},
    {"spherical", features::spherical, [](const Model& model) { return !model.balls.empty(); }},
    {"control", features::control,
     [](const Model& model) { return !model.trajectories.empty() || model.controller.law != Law::none; }},
    {"actuators", features::actuators,
     [](const Model& model) {
       return std::any_of(model.actuators.begin(), model.actuators.end(),
                          [](const Actuator& actuator) { return actuator.acts(); });
     }},
    {"energies", features::energies, [](const Model& model) { return model.fmu.shows(OutputGroup::energy); }},
    {"erk", features::erk, [](const Model& model) { return uses_method(model, SolverMethod::erk); }},
    {"adams", features::adams, [](const Model& model) { return uses_method(model, SolverMethod::adams); }},
    {"dirk", features::dirk, [](const Model& model) { return uses_method(model, SolverMethod::dirk); }},
    {"bdf", features::bdf, [](const Model& model) { return uses_method(model, SolverMethod::bdf); }},
    {"exponential", features::exponential,
     [](const Model& model) { return uses_method(model, SolverMethod::exponential); }},
};

// The general library reads a model file with this method, but cannot step with it.
bool uses_taylor(const Model& model) { return model.solver.method == SolverMethod::taylor; }

}  // namespace

bool may_resist(const Model& model) {
  for (const Link& link : model.links) {
    const Joint& joint = link.joint;
    if (joint.friction != 0 || joint.static_friction != 0 || has_stops(joint)) return true;
  }
  for (const std::string& name : model.fmu.tunable)
    for (const char* word : {".friction", ".static_friction", ".lower", ".upper", ".stop_"})
      if (name.find(word) != name.npos) return true;
  return false;
}

std::vector<std::string> features_of(const Model& model) {
  std::vector<std::string> names;
  for (const Feature& feature : all_features)
    if (feature.used(model)) names.push_back(feature.name);
  if (uses_taylor(model)) names.push_back("taylor");
  return names;
}

std::string missing_feature(const Model& model) {
  for (const Feature& feature : all_features)
    if (!feature.built_in && feature.used(model)) return feature.name;
  return {};
}

std::string objection_to_method(SolverMethod method) {
  if (method == SolverMethod::taylor)
    return features::taylor ? ""
                            : "solver.method 'taylor' requires a library for the model: build-fmu build "
                              "--specialise with method = \"taylor\" in [solver]";
  Model bare;
  bare.fmu.outputs = {};
  bare.solver.method = method;
  const std::string missing = missing_feature(bare);
  return missing.empty()
             ? missing
             : "this library was specialised for its scene and does not include the method " + missing;
}

}  // namespace redysim
