#pragma once

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "fmi/instance/simulation.hpp"
#include "fmi2Functions.h"
#include "model/read/fingerprint.hpp"
#include "model/read/model_file.hpp"

// An FMU linked in, as a master knows it: its resources in a folder, its GUID and its value references.

namespace redysim::process {

[[noreturn]] inline void fail(const std::string& what) {
  std::fprintf(stderr, "%s\n", what.c_str());
  std::_Exit(1);
}

inline void be_silent(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...) {}

inline constexpr const char* methods[] = {"erk", "adams", "dirk", "bdf", "exponential", "auto"};

struct Scene {
  std::string name, folder, guid;
  std::vector<fmi2ValueReference> inputs, outputs, forces;  // forces: of the inputs
  fmi2ValueReference method = 0;
  int states = 0;

  explicit Scene(const std::string& path) {
    namespace fs = std::filesystem;
    const ModelFile file = read_model_file(path);
    name = file.model.name;
    guid = fingerprint(file.source);
    folder = (fs::temp_directory_path() / ("redysim_" + name + "_XXXXXX")).string();
    if (!mkdtemp(folder.data())) fail("no temporary folder can be made");
    fs::copy_file(path, folder + "/model.toml");
    Simulation simulation(file.model, false);
    states = simulation.independent().size();
    for (const Variable& variable : simulation.table.all()) {
      if (variable.type() == VariableType::string && !variable.is_calculated())
        method = variable.value_reference;
      if (variable.type() != VariableType::real) continue;
      if (variable.causality() == Causality::output) outputs.push_back(variable.value_reference);
      if (variable.causality() != Causality::input) continue;
      inputs.push_back(variable.value_reference);
      if (variable.row->owner == Owner::joint && !variable.is_motion())
        forces.push_back(variable.value_reference);
    }
  }
  ~Scene() { std::filesystem::remove_all(folder); }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
};

// One instance, at its first communication point. Whatever is not fmi2OK ends the program.
class Slave {
 public:
  Slave(const Scene& scene, const fmi2CallbackFunctions& functions, const char* method,
        fmi2Type type = fmi2CoSimulation)
      : scene_(scene) {
    component_ = fmi2Instantiate("slave", type, scene.guid.c_str(), scene.folder.c_str(), &functions,
                                 fmi2False, fmi2True);
    if (!component_) fail(scene.name + " cannot be instantiated");
    start(method);
  }
  ~Slave() { fmi2FreeInstance(component_); }
  Slave(const Slave&) = delete;
  Slave& operator=(const Slave&) = delete;
  operator fmi2Component() const { return component_; }

  void start(const char* method) const {
    good(fmi2SetString(component_, &scene_.method, 1, &method));
    good(fmi2SetupExperiment(component_, fmi2False, 0, 0, fmi2False, 0));
    good(fmi2EnterInitializationMode(component_));
    good(fmi2ExitInitializationMode(component_));
  }
  void step(int k, double size, double force) const {
    const std::vector<double> inputs(scene_.inputs.size(), force);
    good(fmi2SetReal(component_, scene_.inputs.data(), inputs.size(), inputs.data()));
    good(fmi2DoStep(component_, k * size, size, fmi2True));
  }
  std::vector<double> outputs() const {
    std::vector<double> found(scene_.outputs.size());
    good(fmi2GetReal(component_, scene_.outputs.data(), found.size(), found.data()));
    return found;
  }
  std::vector<double> derivatives() const {
    std::vector<double> found(scene_.outputs.size());
    const std::vector<double> along(scene_.inputs.size(), 1.0);
    good(fmi2GetDirectionalDerivative(component_, scene_.outputs.data(), found.size(), scene_.inputs.data(),
                                      along.size(), along.data(), found.data()));
    return found;
  }
  void good(fmi2Status status) const {
    if (status != fmi2OK) fail(scene_.name + ": a call was refused");
  }
  void bad(fmi2Status status) const {
    if (status != fmi2Error) fail(scene_.name + ": a call was not refused");
  }

 private:
  const Scene& scene_;
  fmi2Component component_ = nullptr;
};

}  // namespace redysim::process
