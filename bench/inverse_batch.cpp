// Runs an inverse FMU over the rows of a motion, as a compiled master does: set q, qd, qdd, read tau, step
// on.
//   inverse_batch LIBRARY RESOURCES GUID JOINTS INPUT... OUTPUT... < rows
// INPUT: 3 JOINTS value references (all q, all qd, all qdd), OUTPUT: JOINTS. A row: time, q, qd, qdd.
// Prints the median seconds of one batch and its torques.

#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "fmi2Functions.h"

namespace {

constexpr int batches = 2001;

template <class Function>
Function* symbol(void* library, const char* name) {
  if (void* address = dlsym(library, name)) return reinterpret_cast<Function*>(address);
  std::fprintf(stderr, "%s is missing\n", name);
  std::exit(1);
}

void log(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String message, ...) {
  std::fprintf(stderr, "%s\n", message);
}

void expect_ok(fmi2Status status) {
  if (status != fmi2OK) std::exit(1);
}

}  // namespace

int main(int count, char** arguments) {
  const std::size_t joints = count > 4 ? std::strtoul(arguments[4], nullptr, 10) : 0;
  if (joints == 0 || static_cast<std::size_t>(count) != 5 + 4 * joints) {
    std::fputs("usage: inverse_batch LIBRARY RESOURCES GUID JOINTS INPUT... OUTPUT... < rows\n", stderr);
    return 2;
  }
  std::vector<fmi2ValueReference> references;
  for (int i = 5; i < count; ++i)
    references.push_back(static_cast<unsigned>(std::strtoul(arguments[i], nullptr, 10)));
  std::vector<double> numbers;
  for (double number; std::cin >> number;) numbers.push_back(number);
  const std::size_t width = 1 + 3 * joints, rows = numbers.size() / width;

  void* library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    std::fprintf(stderr, "%s\n", dlerror());
    return 1;
  }
  const auto set_real = symbol<fmi2SetRealTYPE>(library, "fmi2SetReal");
  const auto get_real = symbol<fmi2GetRealTYPE>(library, "fmi2GetReal");
  const auto do_step = symbol<fmi2DoStepTYPE>(library, "fmi2DoStep");
  const auto reset = symbol<fmi2ResetTYPE>(library, "fmi2Reset");
  const auto enter = symbol<fmi2EnterInitializationModeTYPE>(library, "fmi2EnterInitializationMode");
  const auto exit = symbol<fmi2ExitInitializationModeTYPE>(library, "fmi2ExitInitializationMode");
  const fmi2CallbackFunctions callbacks{log, nullptr, nullptr, nullptr, nullptr};
  const fmi2Component fmu = symbol<fmi2InstantiateTYPE>(library, "fmi2Instantiate")(
      "inverse", fmi2CoSimulation, arguments[3], arguments[2], &callbacks, fmi2False, fmi2False);
  if (!fmu) return 1;

  std::vector<double> torques(rows * joints), seconds;
  for (int batch = 0; batch < batches; ++batch) {
    expect_ok(reset(fmu));
    const auto begin = std::chrono::steady_clock::now();
    expect_ok(enter(fmu));
    expect_ok(exit(fmu));
    for (std::size_t row = 0; row < rows; ++row) {
      const double* motion = &numbers[row * width];
      expect_ok(set_real(fmu, references.data(), 3 * joints, motion + 1));
      expect_ok(get_real(fmu, references.data() + 3 * joints, joints, &torques[row * joints]));
      if (row + 1 < rows) expect_ok(do_step(fmu, motion[0], motion[width] - motion[0], fmi2True));
    }
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  symbol<fmi2FreeInstanceTYPE>(library, "fmi2FreeInstance")(fmu);
  std::nth_element(seconds.begin(), seconds.begin() + batches / 2, seconds.end());
  std::printf("%.9g\n", seconds[batches / 2]);
  for (double torque : torques) std::printf("%.17g\n", torque);
}
