// fmu_driver < JOB: loads an FMI 2.0 co-simulation FMU, runs it like a compiled master and prints JSON.
// Format of a job: see job.cpp. A call that does not return is reported as a hang.

#include "drive/run.hpp"

using namespace redysim;
using namespace redysim::drive;

int main() {
  return serve_job("fmu_driver", [](const FmuLibrary& fmu, const Job& job, const std::string& why,
                                    Watchdog& watchdog, Json& json) {
    if (why.empty())
      run(fmu, job, watchdog, json);
    else
      json.member("status", "not loaded").key("log").begin_array().value(std::string_view(why)).end_array();
  });
}
