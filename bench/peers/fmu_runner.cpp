// Runs an FMU through its library as a compiled master does, for work_precision.py (see serve.hpp).
//   fmu_runner LIBRARY RESOURCES GUID ROWS STEP METHOD_VR RTOL_VR ATOL_VR RHS_VR
//              OUTPUTS VR... INPUTS (VR VALUE)...
// Method: that of the FMU's solver, value: its rtol. `METHOD:NUMBER` cuts each of the steps into NUMBER equal
// ones; `METHOD/NUMBER` also changes all inputs at each of them, ever so little, and gives the count of
// right-hand sides in place of the last number; `METHOD~NUMBER` changes their sign at each of them.

#include <dlfcn.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "fmi2Functions.h"
#include "serve.hpp"

namespace {

template <class Function>
Function* symbol(void* library, const char* name) {
  if (void* address = dlsym(library, name)) return reinterpret_cast<Function*>(address);
  std::fprintf(stderr, "%s is missing\n", name);
  std::exit(1);
}

std::string last_message;

void log(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String message, ...) {
  last_message = message;
}

struct Arguments {
  char** next;
  const char* text() {
    if (*next) return *next++;
    std::fputs("too few arguments\n", stderr);
    std::exit(2);
  }
  double number() { return std::atof(text()); }
  unsigned reference() { return static_cast<unsigned>(std::strtoul(text(), nullptr, 10)); }
};

}  // namespace

int main(int, char** arguments) {
  using redysim::bench::Run;
  Arguments given{arguments + 1};
  void* library = dlopen(given.text(), RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    std::fprintf(stderr, "%s\n", dlerror());
    return 1;
  }
  const char* resources = given.text();
  const char* guid = given.text();
  const int rows = static_cast<int>(given.number());
  const double step = given.number();
  const fmi2ValueReference method_vr = given.reference(), rtol_vr = given.reference(),
                           atol_vr = given.reference(), rhs_vr = given.reference();
  std::vector<fmi2ValueReference> outputs(given.reference());
  for (auto& reference : outputs) reference = given.reference();
  std::vector<fmi2ValueReference> inputs(given.reference());
  std::vector<double> values(inputs.size());
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    inputs[i] = given.reference();
    values[i] = given.number();
  }

  const auto set_real = symbol<fmi2SetRealTYPE>(library, "fmi2SetReal");
  const auto set_string = symbol<fmi2SetStringTYPE>(library, "fmi2SetString");
  const auto get_real = symbol<fmi2GetRealTYPE>(library, "fmi2GetReal");
  const auto get_integer = symbol<fmi2GetIntegerTYPE>(library, "fmi2GetInteger");
  const auto do_step = symbol<fmi2DoStepTYPE>(library, "fmi2DoStep");
  const auto reset = symbol<fmi2ResetTYPE>(library, "fmi2Reset");
  const auto set_up = symbol<fmi2SetupExperimentTYPE>(library, "fmi2SetupExperiment");
  const auto enter = symbol<fmi2EnterInitializationModeTYPE>(library, "fmi2EnterInitializationMode");
  const auto leave = symbol<fmi2ExitInitializationModeTYPE>(library, "fmi2ExitInitializationMode");
  const fmi2CallbackFunctions callbacks{log, nullptr, nullptr, nullptr, nullptr};
  const fmi2Component fmu = symbol<fmi2InstantiateTYPE>(library, "fmi2Instantiate")(
      "peer", fmi2CoSimulation, guid, resources, &callbacks, fmi2False, fmi2False);
  if (!fmu) {
    std::fprintf(stderr, "%s\n", last_message.c_str());
    return 1;
  }

  redysim::bench::serve(outputs.size(), [&](const std::string& request, double rtol) {
    Run run;
    const std::size_t cut_at = std::min(request.find_first_of(":/~"), request.size());
    const std::string method = request.substr(0, cut_at);
    const char kind = cut_at < request.size() ? request[cut_at] : ':';
    const int cuts = cut_at < request.size() ? std::atoi(request.c_str() + cut_at + 1) : 1;
    const char* name = method.c_str();
    const double atol = rtol / 100;
    bool good = reset(fmu) == fmi2OK && set_up(fmu, fmi2False, 0, 0, fmi2False, 0) == fmi2OK &&
                set_string(fmu, &method_vr, 1, &name) == fmi2OK &&
                set_real(fmu, &rtol_vr, 1, &rtol) == fmi2OK && set_real(fmu, &atol_vr, 1, &atol) == fmi2OK &&
                enter(fmu) == fmi2OK &&
                set_real(fmu, inputs.data(), inputs.size(), values.data()) == fmi2OK && leave(fmu) == fmi2OK;
    std::vector<double> changing = values;
    run.rows.resize(static_cast<std::size_t>(rows + 1) * outputs.size());
    good = good && get_real(fmu, outputs.data(), outputs.size(), run.rows.data()) == fmi2OK;
    const double begin = redysim::bench::cpu_seconds();
    for (int row = 0; row < rows && good; ++row) {
      const double size = step / cuts;
      for (int cut = 0; cut < cuts && good; ++cut) {
        if (kind == '/')
          for (double& value : changing) value += 1e-9;
        if (kind != ':') good = set_real(fmu, inputs.data(), inputs.size(), changing.data()) == fmi2OK;
        good = good && do_step(fmu, row * step + cut * size, size, fmi2True) == fmi2OK;
        if (kind == '~')
          for (double& value : changing) value = -value;
      }
      good = good && get_real(fmu, outputs.data(), outputs.size(),
                              &run.rows[static_cast<std::size_t>(row + 1) * outputs.size()]) == fmi2OK;
    }
    run.seconds = redysim::bench::cpu_seconds() - begin;
    if (!good) run.failure = last_message.empty() ? "a call was refused" : last_message;
    if (good && kind == '/') {
      fmi2Integer evaluations = 0;
      get_integer(fmu, &rhs_vr, 1, &evaluations);
      run.rows.back() = evaluations;
    }
    return run;
  });
  symbol<fmi2FreeInstanceTYPE>(library, "fmi2FreeInstance")(fmu);
}
