// fmu_driver < JOB: loads an FMI 2.0 co-simulation FMU, runs it as a compiled master does, prints JSON.
// The lines of a job are those of job.cpp. A call that never returns is reported as a hang.

#include <cstdio>
#include <exception>
#include <iostream>

#include "drive/run.hpp"

using namespace redysim;
using namespace redysim::drive;

int main() {
  try {
    const Job job = read_job(std::cin);
    FmuLibrary fmu;
    Json json;
    json.begin_object();
    {
      Watchdog watchdog(job.budget + job.patience);
      const std::string why = fmu.load(job.library);
      if (!why.empty())
        json.member("status", "not loaded").key("log").begin_array().value(std::string_view(why)).end_array();
      else
        run(fmu, job, watchdog, json);
    }
    json.end_object();
    std::printf("%s\n", json.text().c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fmu_driver: %s\n", error.what());
    return 2;
  }
}
