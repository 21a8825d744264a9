#pragma once

#include "drive/fmu_library.hpp"
#include "drive/job.hpp"
#include "drive/watchdog.hpp"
#include "fmi/describe/json.hpp"

namespace redysim::drive {

// Takes an instance to its first step: start values, first inputs, initialisation.
fmi2Status initialise(const FmuLibrary& fmu, fmi2Component instance, const Job& job);

// Sets the inputs of step `index`.
fmi2Status set_inputs(const FmuLibrary& fmu, fmi2Component instance, const Job& job, long index);

// Runs the job and writes members into the open JSON object.
void run(const FmuLibrary& fmu, const Job& job, Watchdog& watchdog, Json& json);

}  // namespace redysim::drive
