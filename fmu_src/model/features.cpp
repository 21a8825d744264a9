#include "model/features.hpp"

#include <algorithm>
#include <iterator>

#include "model/any_of.hpp"

namespace redysim {
namespace {

struct Feature {
  char name[16];  // a pointer would need relocation when the library is loaded
  bool built_in;
  bool (*used)(const Model&);
  bool of_smooth_trees = false;  // open trees with only inputs, springs and dampers have it
};

template <SolverMethod method>
bool uses_method(const Model& model) {
  const SolverMethod chosen = model.solver.method;
  return chosen == method || chosen == SolverMethod::automatic;
}

constexpr Feature all_features[] = {
    {"loops", features::loops, [](const Model& model) { return model.has_constraints(); }},
    {"springs", features::springs,
     [](const Model& model) {
       return !model.springs.empty() ||
              any_of(model.couplings, [](const Coupling& coupling) { return !coupling.rigid(); });
     }},
    {"bushings", features::bushings, [](const Model& model) { return !model.bushings.empty(); }},
    {"contact", features::contact, [](const Model& model) { return !model.contacts.empty(); }},
    {"friction", features::friction, may_resist},
    {"ports", features::ports,
     [](const Model& model) {
       return any_of(model.frames, [](const Frame& frame) { return frame.port != Frame::Port::none; });
     }},
    {"motion", features::motion,
     [](const Model& model) {
       return any_of(model.links,
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
       return any_of(model.actuators, [](const Actuator& actuator) { return actuator.acts(); });
     }},
    {"energies", features::energies, [](const Model& model) { return model.fmu.shows(OutputGroup::energy); },
     true},
    {"erk", features::erk, uses_method<SolverMethod::erk>, true},
    {"adams", features::adams, uses_method<SolverMethod::adams>, true},
    {"dirk", features::dirk, uses_method<SolverMethod::dirk>, true},
    {"bdf", features::bdf, uses_method<SolverMethod::bdf>, true},
    {"exponential", features::exponential, uses_method<SolverMethod::exponential>, true},
};

// With more joints than this, `erk` is faster (docs/specialise.md).
constexpr std::ptrdiff_t most_joints_of_series = 4;

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

bool uses_series(const Model& model) {
  if (model.solver.method != SolverMethod::automatic) return model.solver.method == SolverMethod::taylor;
  const auto joints = std::count_if(model.links.begin(), model.links.end(),
                                    [](const Link& link) { return moves(link.joint); });
  return joints <= most_joints_of_series && !any_of(all_features, [&model](const Feature& feature) {
           return !feature.of_smooth_trees && feature.used(model);
         });
}

std::vector<std::string> features_of(const Model& model) {
  std::vector<std::string> names;
  for (const Feature& feature : all_features)
    if (feature.used(model)) names.push_back(feature.name);
  if (uses_series(model)) names.push_back("taylor");
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
