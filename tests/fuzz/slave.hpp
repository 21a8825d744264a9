#pragma once

#include <cstdarg>
#include <cstdlib>
#include <fstream>
#include <string>

#include "fmi2Functions.h"
#include "model/read/fingerprint.hpp"
#include "model/read/model_file.hpp"

// One instance of the double pendulum's FMU, linked in: the library's own C boundary without a loader.

namespace redysim::fuzz {

inline void be_silent(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...) {}

class Slave {
 public:
  Slave() {
    // the folder of the models, laid out as an FMU's resources by scripts/fuzz.sh
    const char* folder = std::getenv("REDYSIM_FUZZ_RESOURCES");
    if (!folder) std::abort();
    const ModelFile file = read_model_file(std::string(folder) + "/model.toml");
    const fmi2CallbackFunctions functions{be_silent, nullptr, nullptr, nullptr, nullptr};
    component_ = fmi2Instantiate("fuzz", fmi2CoSimulation, fingerprint(file.source).c_str(), folder,
                                 &functions, fmi2False, fmi2True);
    if (!component_) std::abort();
  }
  ~Slave() { fmi2FreeInstance(component_); }
  Slave(const Slave&) = delete;
  Slave& operator=(const Slave&) = delete;

  operator fmi2Component() const { return component_; }

 private:
  fmi2Component component_ = nullptr;
};

}  // namespace redysim::fuzz
