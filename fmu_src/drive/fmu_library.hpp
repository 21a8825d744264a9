#pragma once

#include <string>
#include <vector>

#include "fmi2Functions.h"

namespace redysim::drive {

// The functions in the shared library of an FMU. `load` returns the reason of a failure, or an empty string.
struct FmuLibrary {
  std::string load(const std::string& path);

  fmi2InstantiateTYPE* instantiate = nullptr;
  fmi2FreeInstanceTYPE* free_instance = nullptr;
  fmi2SetupExperimentTYPE* setup_experiment = nullptr;
  fmi2EnterInitializationModeTYPE* enter_initialization_mode = nullptr;
  fmi2ExitInitializationModeTYPE* exit_initialization_mode = nullptr;
  fmi2ResetTYPE* reset = nullptr;
  fmi2SetRealTYPE* set_real = nullptr;
  fmi2GetRealTYPE* get_real = nullptr;
  fmi2GetIntegerTYPE* get_integer = nullptr;
  fmi2GetStringTYPE* get_string = nullptr;
  fmi2SetStringTYPE* set_string = nullptr;
  fmi2DoStepTYPE* do_step = nullptr;
  fmi2GetRealStatusTYPE* get_real_status = nullptr;
};

// Warnings and errors of an FMU at run time. Keeps only the first and the last ones.
class MessageLog {
 public:
  void add(fmi2Status status, const char* text);
  const std::vector<std::string>& lines() const { return lines_; }
  static void callback(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                       fmi2String category, fmi2String message, ...);

 private:
  std::vector<std::string> lines_;
};

}  // namespace redysim::drive
