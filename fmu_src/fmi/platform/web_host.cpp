// The library in a web page: creates instances whose log goes to the page. The page also provides the model
// file and the files that it names (model/read/open_file.cpp).

#include "fmi2Functions.h"

extern "C" {

__attribute__((import_module("host"), import_name("log"))) void redysim_host_log(int status,
                                                                                 const char* text);

// Creates an instance of the model file `model/model.toml`. Returns null and logs the reason if that fails.
fmi2Component redysim_instantiate(fmi2String guid);

}  // extern "C"

namespace {

// Percent signs of the text are doubled, as for a printf format.
void log(fmi2ComponentEnvironment, fmi2String, fmi2Status status, fmi2String, fmi2String text, ...) {
  redysim_host_log(status, text);
}

constexpr fmi2CallbackFunctions callbacks{log, nullptr, nullptr, nullptr, nullptr};

}  // namespace

fmi2Component redysim_instantiate(fmi2String guid) {
  return fmi2Instantiate("page", fmi2CoSimulation, guid, "model", &callbacks, fmi2False, fmi2False);
}
