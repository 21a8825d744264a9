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

constexpr Feature all_features[] = {
    {"loops", features::loops, [](const Model& model) { return !model.loops.empty(); }},
    {"springs", features::springs, [](const Model& model) { return !model.springs.empty(); }},
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
    {"erk", features::erk, [](const Model& model) { return uses_method(model, SolverMethod::erk); }},
    {"adams", features::adams, [](const Model& model) { return uses_method(model, SolverMethod::adams); }},
    {"dirk", features::dirk, [](const Model& model) { return uses_method(model, SolverMethod::dirk); }},
    {"bdf", features::bdf, [](const Model& model) { return uses_method(model, SolverMethod::bdf); }},
};

}  // namespace

std::vector<std::string> features_of(const Model& model) {
  std::vector<std::string> names;
  for (const Feature& feature : all_features)
    if (feature.used(model)) names.push_back(feature.name);
  return names;
}

std::string missing_feature(const Model& model) {
  for (const Feature& feature : all_features)
    if (!feature.built_in && feature.used(model)) return feature.name;
  return {};
}

bool has_method(SolverMethod method) {
  Model bare;
  bare.solver.method = method;
  return missing_feature(bare).empty();
}

}  // namespace redysim
