// Runs an FMU through its library as a compiled master, for work_precision.py (see serve.hpp).
//   fmu_runner LIBRARY RESOURCES GUID ROWS STEP METHOD_VR RTOL_VR ATOL_VR RHS_VR
//              OUTPUTS VR... INPUTS (VR VALUE)...
// Method: solver.method, value: solver.rtol. `METHOD:NUMBER` divides each step into NUMBER equal steps.
// `METHOD/NUMBER` also changes all inputs slightly at each of these, and returns the number of right-hand
// sides in place of the last number. `METHOD~NUMBER` changes the sign of the inputs at each of these.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "drive/fmu_library.hpp"
#include "serve.hpp"

namespace {

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
  using redysim::drive::MessageLog;
  Arguments given{arguments + 1};
  redysim::drive::FmuLibrary fmu;
  const std::string missing = fmu.load(given.text());
  if (!missing.empty()) {
    std::fprintf(stderr, "%s\n", missing.c_str());
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

  MessageLog log;
  const auto last_message = [&log] {
    return log.lines().empty() ? std::string("a call was refused") : log.lines().back();
  };
  const fmi2CallbackFunctions callbacks{MessageLog::callback, nullptr, nullptr, nullptr, &log};
  const fmi2Component instance =
      fmu.instantiate("peer", fmi2CoSimulation, guid, resources, &callbacks, fmi2False, fmi2False);
  if (!instance) {
    std::fprintf(stderr, "%s\n", last_message().c_str());
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
    bool good = fmu.reset(instance) == fmi2OK &&
                fmu.setup_experiment(instance, fmi2False, 0, 0, fmi2False, 0) == fmi2OK &&
                fmu.set_string(instance, &method_vr, 1, &name) == fmi2OK &&
                fmu.set_real(instance, &rtol_vr, 1, &rtol) == fmi2OK &&
                fmu.set_real(instance, &atol_vr, 1, &atol) == fmi2OK &&
                fmu.enter_initialization_mode(instance) == fmi2OK &&
                fmu.set_real(instance, inputs.data(), inputs.size(), values.data()) == fmi2OK &&
                fmu.exit_initialization_mode(instance) == fmi2OK;
    std::vector<double> changing = values;
    run.rows.resize(static_cast<std::size_t>(rows + 1) * outputs.size());
    good = good && fmu.get_real(instance, outputs.data(), outputs.size(), run.rows.data()) == fmi2OK;
    const double begin = redysim::bench::cpu_seconds();
    for (int row = 0; row < rows && good; ++row) {
      const double size = step / cuts;
      for (int cut = 0; cut < cuts && good; ++cut) {
        if (kind == '/')
          for (double& value : changing) value += 1e-9;
        if (kind != ':')
          good = fmu.set_real(instance, inputs.data(), inputs.size(), changing.data()) == fmi2OK;
        good = good && fmu.do_step(instance, row * step + cut * size, size, fmi2True) == fmi2OK;
        if (kind == '~')
          for (double& value : changing) value = -value;
      }
      good = good && fmu.get_real(instance, outputs.data(), outputs.size(),
                                  &run.rows[static_cast<std::size_t>(row + 1) * outputs.size()]) == fmi2OK;
    }
    run.seconds = redysim::bench::cpu_seconds() - begin;
    if (!good) run.failure = last_message();
    if (good && kind == '/') {
      fmi2Integer evaluations = 0;
      fmu.get_integer(instance, &rhs_vr, 1, &evaluations);
      run.rows.back() = evaluations;
    }
    return run;
  });
  fmu.free_instance(instance);
}
