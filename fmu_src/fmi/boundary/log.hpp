#pragma once

#include <cstddef>
#include <string>

#include "fmi/boundary/call_table.hpp"
#include "fmi2Functions.h"
#include "fmi3Functions.h"

namespace redysim {

// The log categories, in the order of the XML; the first one includes all others.
inline constexpr const char* log_categories[] = {"logAll", "logStatusError", "logStatusWarning", "logEvents"};

// Passes messages to the logger of the environment, if there is one. Errors are on by default, the other
// categories on request.
class Log {
 public:
  Log(const fmi2CallbackFunctions* functions, const char* instance_name, bool all);
  Log(fmi3LogMessageCallback logger, fmi3InstanceEnvironment environment, bool all);

  FmiVersion version() const { return version_; }

  void error(const std::string& text) const { write(errors_, fmi2Error, 1, text); }
  // `status`: that of the call.
  void warning(const std::string& text, fmi2Status status = fmi2Warning) const {
    write(warnings_, status, 2, text);
  }
  void event(const std::string& text) const { write(events_, fmi2OK, 3, text); }
  bool events() const { return events_; }
  bool warnings() const { return warnings_; }

  // Switches categories (count 0: all). Returns the first unknown name, and then changes nothing, or null.
  const char* set(bool on, std::size_t count, const char* const* categories);

 private:
  void write(bool on, fmi2Status status, int category, const std::string& text) const;

  FmiVersion version_;
  fmi2CallbackLogger logger_ = nullptr;
  fmi3LogMessageCallback plain_logger_ = nullptr;
  void* environment_ = nullptr;
  std::string instance_name_;
  bool errors_ = true, warnings_ = false, events_ = false;
};

}  // namespace redysim
