#pragma once

#include "drive/fmu_library.hpp"
#include "drive/job.hpp"
#include "drive/watchdog.hpp"
#include "fmi/describe/json.hpp"

namespace redysim::drive {

// `main` of a driver: reads a job, loads its library and writes JSON to standard output. `answer` writes the
// members of the JSON object; `why`: reason why the library did not load, or empty. Returns the exit code.
using Answer = void(const FmuLibrary& fmu, const Job& job, const std::string& why, Watchdog& watchdog,
                    Json& json);
int serve_job(const char* program, Answer* answer);

// Prepares an instance for its first step: start values, first inputs, initialisation.
fmi2Status initialise(const FmuLibrary& fmu, fmi2Component instance, const Job& job, long first = 0);

// Sets the inputs of step `index`.
fmi2Status set_inputs(const FmuLibrary& fmu, fmi2Component instance, const Job& job, long index);

// Runs the job and writes members into the open JSON object.
void run(const FmuLibrary& fmu, const Job& job, Watchdog& watchdog, Json& json);

}  // namespace redysim::drive
