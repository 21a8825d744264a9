// The library in a web page: instances whose log goes to the page. The model file and the files that it names
// come from the page, too (model/read/open_file.cpp).

#include "fmi2Functions.h"

extern "C" {

__attribute__((import_module("host"), import_name("log"))) void redysim_host_log(int status,
                                                                                 const char* text);

// The instance of the model file `model/model.toml`; null, with the reason logged, if there is none.
fmi2Component redysim_instantiate(fmi2String guid);

}  // extern "C"

namespace {

// Percent signs of the text are doubled, as in every printf format.
void log(fmi2ComponentEnvironment, fmi2String, fmi2Status status, fmi2String, fmi2String text, ...) {
  redysim_host_log(status, text);
}

constexpr fmi2CallbackFunctions callbacks{log, nullptr, nullptr, nullptr, nullptr};

}  // namespace

fmi2Component redysim_instantiate(fmi2String guid) {
  return fmi2Instantiate("page", fmi2CoSimulation, guid, "model", &callbacks, fmi2False, fmi2False);
}
