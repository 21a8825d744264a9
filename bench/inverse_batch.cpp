// Runs an inverse FMU over the rows of a motion as a compiled master: set q, qd, qdd, read tau, step.
//   inverse_batch LIBRARY RESOURCES GUID JOINTS INPUT... OUTPUT... < rows
// INPUT: 3 JOINTS value references (all q, all qd, all qdd), OUTPUT: JOINTS. A row: time, q, qd, qdd.
// Prints the median time of one batch in s and its torques.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "drive/fmu_library.hpp"

namespace {

constexpr int batches = 2001;

using redysim::drive::FmuLibrary;
using redysim::drive::MessageLog;

[[noreturn]] void give_up(const std::string& why) {
  std::fprintf(stderr, "%s\n", why.c_str());
  std::exit(1);
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

  FmuLibrary fmu;
  const std::string missing = fmu.load(arguments[1]);
  if (!missing.empty()) give_up(missing);
  MessageLog log;
  const auto expect_ok = [&log](fmi2Status status) {
    if (status != fmi2OK) give_up(log.lines().empty() ? "a call was refused" : log.lines().back());
  };
  const fmi2CallbackFunctions callbacks{MessageLog::callback, nullptr, nullptr, nullptr, &log};
  const fmi2Component instance = fmu.instantiate("inverse", fmi2CoSimulation, arguments[3], arguments[2],
                                                 &callbacks, fmi2False, fmi2False);
  if (!instance) give_up(log.lines().empty() ? "no instance" : log.lines().back());

  std::vector<double> torques(rows * joints), seconds;
  for (int batch = 0; batch < batches; ++batch) {
    expect_ok(fmu.reset(instance));
    const auto begin = std::chrono::steady_clock::now();
    expect_ok(fmu.enter_initialization_mode(instance));
    expect_ok(fmu.exit_initialization_mode(instance));
    for (std::size_t row = 0; row < rows; ++row) {
      const double* motion = &numbers[row * width];
      expect_ok(fmu.set_real(instance, references.data(), 3 * joints, motion + 1));
      expect_ok(fmu.get_real(instance, references.data() + 3 * joints, joints, &torques[row * joints]));
      if (row + 1 < rows) expect_ok(fmu.do_step(instance, motion[0], motion[width] - motion[0], fmi2True));
    }
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  fmu.free_instance(instance);
  std::nth_element(seconds.begin(), seconds.begin() + batches / 2, seconds.end());
  std::printf("%.9g\n", seconds[batches / 2]);
  for (double torque : torques) std::printf("%.17g\n", torque);
}
