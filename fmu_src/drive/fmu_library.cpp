#include "drive/fmu_library.hpp"

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

#include <cstdarg>
#include <cstdio>

namespace redysim::drive {
namespace {

constexpr std::size_t most_lines = 20;

#ifdef _WIN32
using Library = HMODULE;

// Windows interprets narrow file names in the code page of the machine.
Library open_library(const std::string& path, std::string& why) {
  std::wstring wide(path.size() + 1, L'\0');
  Library library = nullptr;
  if (MultiByteToWideChar(CP_UTF8, 0, path.c_str(), -1, wide.data(), static_cast<int>(wide.size())) > 0)
    library = LoadLibraryW(wide.c_str());
  if (!library) why = path + " cannot be loaded: error " + std::to_string(GetLastError()) + " of Windows";
  return library;
}

void* symbol(Library library, const char* name) {
  return reinterpret_cast<void*>(GetProcAddress(library, name));
}
#else
using Library = void*;

Library open_library(const std::string& path, std::string& why) {
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) why = dlerror();
  return library;
}

void* symbol(Library library, const char* name) { return dlsym(library, name); }
#endif

template <class Type>
bool find(Library library, const char* name, Type*& function, std::string& missing) {
  function = reinterpret_cast<Type*>(symbol(library, name));
  if (!function && missing.empty()) missing = std::string("the library has no function ") + name;
  return function != nullptr;
}

}  // namespace

std::string FmuLibrary::load(const std::string& path) {
  std::string missing;
  const Library library = open_library(path, missing);
  if (!library) return missing;
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
