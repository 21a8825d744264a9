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

using redysim::bench::Run;
using redysim::drive::MessageLog;

// What stands on the command line behind the library.
struct Task {
  const char *resources, *guid;
  int rows;
  double step;
  fmi2ValueReference method, rtol, atol, evaluations;
  std::vector<fmi2ValueReference> outputs, inputs;
  std::vector<double> values;  // of the inputs

  explicit Task(Arguments& given)
      : resources(given.text()),
        guid(given.text()),
        rows(static_cast<int>(given.number())),
        step(given.number()),
        method(given.reference()),
        rtol(given.reference()),
        atol(given.reference()),
        evaluations(given.reference()),
        outputs(given.reference()) {
    for (auto& reference : outputs) reference = given.reference();
    inputs.resize(given.reference());
    for (auto& reference : inputs) {
      reference = given.reference();
      values.push_back(given.number());
    }
  }
};

// `METHOD`, `METHOD:NUMBER`, `METHOD/NUMBER` or `METHOD~NUMBER`.
struct Request {
  std::string method;
  char kind = ':';
  int cuts = 1;

  explicit Request(const std::string& text) {
    const std::size_t end = std::min(text.find_first_of(":/~"), text.size());
    method = text.substr(0, end);
    if (end == text.size()) return;
    kind = text[end];
    cuts = std::atoi(text.c_str() + end + 1);
  }
};

class Master {
 public:
  Master(const redysim::drive::FmuLibrary& fmu, const Task& task)
      : fmu_(fmu),
        task_(task),
        instance_(fmu.instantiate("peer", fmi2CoSimulation, task.guid, task.resources, &callbacks_, fmi2False,
                                  fmi2False)) {}
  ~Master() {
    if (instance_) fmu_.free_instance(instance_);
  }
  Master(const Master&) = delete;
  Master& operator=(const Master&) = delete;

  bool is_there() const { return instance_; }
  std::string last_message() const {
    return log_.lines().empty() ? std::string("a call was refused") : log_.lines().back();
  }

  Run run(const Request& request, double rtol) const {
    Run run;
    run.rows.resize(static_cast<std::size_t>(task_.rows + 1) * task_.outputs.size());
    std::vector<double> values = task_.values;
    bool good = start(request.method.c_str(), rtol) && read(run, 0);
    const double begin = redysim::bench::cpu_seconds();
    for (int row = 0; row < task_.rows && good; ++row) {
      for (int cut = 0; cut < request.cuts && good; ++cut) good = step(request, row, cut, values);
      good = good && read(run, row + 1);
    }
    run.seconds = redysim::bench::cpu_seconds() - begin;
    if (!good) run.failure = last_message();
    if (good && request.kind == '/') {
      fmi2Integer evaluations = 0;
      fmu_.get_integer(instance_, &task_.evaluations, 1, &evaluations);
      run.rows.back() = evaluations;
    }
    return run;
  }

 private:
  bool start(const char* method, double rtol) const {
    const double atol = rtol / 100;
    return fmu_.reset(instance_) == fmi2OK &&
           fmu_.setup_experiment(instance_, fmi2False, 0, 0, fmi2False, 0) == fmi2OK &&
           fmu_.set_string(instance_, &task_.method, 1, &method) == fmi2OK &&
           fmu_.set_real(instance_, &task_.rtol, 1, &rtol) == fmi2OK &&
           fmu_.set_real(instance_, &task_.atol, 1, &atol) == fmi2OK &&
           fmu_.enter_initialization_mode(instance_) == fmi2OK && set(task_.values) &&
           fmu_.exit_initialization_mode(instance_) == fmi2OK;
  }
  bool set(const std::vector<double>& values) const {
    return fmu_.set_real(instance_, task_.inputs.data(), values.size(), values.data()) == fmi2OK;
  }
  bool read(Run& run, int row) const {
    const std::size_t count = task_.outputs.size();
    return fmu_.get_real(instance_, task_.outputs.data(), count,
                         &run.rows[static_cast<std::size_t>(row) * count]) == fmi2OK;
  }
  bool step(const Request& request, int row, int cut, std::vector<double>& values) const {
    const double size = task_.step / request.cuts;
    if (request.kind == '/')
      for (double& value : values) value += 1e-9;
    if (request.kind != ':' && !set(values)) return false;
    const bool good = fmu_.do_step(instance_, row * task_.step + cut * size, size, fmi2True) == fmi2OK;
    if (request.kind == '~')
      for (double& value : values) value = -value;
    return good;
  }

  const redysim::drive::FmuLibrary& fmu_;
  const Task& task_;
  MessageLog log_;
  fmi2CallbackFunctions callbacks_{MessageLog::callback, nullptr, nullptr, nullptr, &log_};
  fmi2Component instance_;
};

}  // namespace

int main(int, char** arguments) {
  Arguments given{arguments + 1};
  redysim::drive::FmuLibrary fmu;
  const std::string missing = fmu.load(given.text());
  if (!missing.empty()) {
    std::fprintf(stderr, "%s\n", missing.c_str());
    return 1;
  }
  const Task task(given);
  const Master master(fmu, task);
  if (!master.is_there()) {
    std::fprintf(stderr, "%s\n", master.last_message().c_str());
    return 1;
  }
  redysim::bench::serve(task.outputs.size(), [&](const std::string& request, double rtol) {
    return master.run(Request(request), rtol);
  });
}
