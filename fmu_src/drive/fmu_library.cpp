#include "drive/fmu_library.hpp"

#include <dlfcn.h>

#include <cstdarg>
#include <cstdio>

namespace redysim::drive {
namespace {

constexpr std::size_t most_lines = 20;

template <class Type>
bool find(void* library, const char* name, Type*& function, std::string& missing) {
  function = reinterpret_cast<Type*>(dlsym(library, name));
  if (!function && missing.empty()) missing = std::string("the library has no function ") + name;
  return function != nullptr;
}

}  // namespace

std::string FmuLibrary::load(const std::string& path) {
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) return dlerror();
  std::string missing;
  find(library, "fmi2Instantiate", instantiate, missing);
  find(library, "fmi2FreeInstance", free_instance, missing);
  find(library, "fmi2SetupExperiment", setup_experiment, missing);
  find(library, "fmi2EnterInitializationMode", enter_initialization_mode, missing);
  find(library, "fmi2ExitInitializationMode", exit_initialization_mode, missing);
  find(library, "fmi2Reset", reset, missing);
  find(library, "fmi2SetReal", set_real, missing);
  find(library, "fmi2GetReal", get_real, missing);
  find(library, "fmi2GetInteger", get_integer, missing);
  find(library, "fmi2GetString", get_string, missing);
  find(library, "fmi2SetString", set_string, missing);
  find(library, "fmi2DoStep", do_step, missing);
  find(library, "fmi2GetRealStatus", get_real_status, missing);
  return missing;
}

void MessageLog::add(fmi2Status status, const char* text) {
  const std::string line = (status == fmi2Warning ? "warning: " : "") + std::string(text);
  if (lines_.size() < most_lines)
    lines_.push_back(line);
  else
    lines_.back() = line;
}

void MessageLog::callback(fmi2ComponentEnvironment environment, fmi2String, fmi2Status status, fmi2String,
                          fmi2String message, ...) {
  if (status == fmi2OK || !message) return;
  char text[1024];
  va_list arguments;
  va_start(arguments, message);
  std::vsnprintf(text, sizeof text, message, arguments);
  va_end(arguments);
  static_cast<MessageLog*>(environment)->add(status, text);
}

}  // namespace redysim::drive
