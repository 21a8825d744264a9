#include "fmi/boundary/log.hpp"

#include <cstring>
#include <iterator>

namespace redysim {

Log::Log(const fmi2CallbackFunctions* functions, const char* instance_name, bool all)
    : version_(FmiVersion::two),
      instance_name_(instance_name ? instance_name : ""),
      warnings_(all),
      events_(all) {
  if (!functions) return;
  logger_ = functions->logger;
  environment_ = functions->componentEnvironment;
}

Log::Log(fmi3LogMessageCallback logger, fmi3InstanceEnvironment environment, bool all)
    : version_(FmiVersion::three),
      plain_logger_(logger),
      environment_(environment),
      warnings_(all),
      events_(all) {}

const char* Log::set(bool on, std::size_t count, const char* const* categories) {
  if (count == 0) {
    errors_ = warnings_ = events_ = on;
    return nullptr;
  }
  bool named[std::size(log_categories)] = {};
  for (std::size_t i = 0; i < count; ++i) {
    const char* name = categories[i] ? categories[i] : "(null)";
    bool known = false;
    for (std::size_t k = 0; k < std::size(log_categories); ++k)
      if (std::strcmp(name, log_categories[k].name) == 0) known = named[k] = true;
    if (!known) return name;
  }
  // "on" enables only the named categories, "off" disables the named ones
  bool* const switches[] = {&errors_, &warnings_, &events_};
  for (std::size_t k = 0; k < std::size(switches); ++k) {
    const bool chosen = named[0] || named[k + 1];
    *switches[k] = on ? chosen : *switches[k] && !chosen;
  }
  return nullptr;
}

void Log::write(bool on, fmi2Status status, int category, const std::string& text) const {
  if (on && plain_logger_)
    plain_logger_(environment_, static_cast<fmi3Status>(status), log_categories[category].name, text.c_str());
  if (!on || !logger_) return;
  // the message is a printf format: percent signs of the text are doubled; loggers without formatting show
  // both
  std::string format;
  format.reserve(text.size());
  for (char c : text) {
    format += c;
    if (c == '%') format += c;
  }
  logger_(environment_, instance_name_.c_str(), status, log_categories[category].name, format.c_str());
}

}  // namespace redysim
