#pragma once

#include <optional>
#include <string>

#include "fmi/boundary/log.hpp"
#include "model/model.hpp"

// The part of an instantiation that all versions of FMI share.

namespace redysim {

struct LoadedModel {
  Model model;
  std::string guid;
};

// Reads the model file of the unpacked FMU and compares its GUID with the master's. Empty: refused; the
// reason is logged as "<function>: ...".
std::optional<LoadedModel> load_model(const Log& log, const char* function, const char* instance_name,
                                      const char* guid, const char* location);

// Logs the exception that is being handled.
void log_exception(const Log& log, const char* function) noexcept;

}  // namespace redysim
