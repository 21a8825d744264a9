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
      if (std::strcmp(name, log_categories[k]) == 0) known = named[k] = true;
    if (!known) return name;
  }
  // "off" disables the named categories, "on" enables them, in FMI 2 only them
  bool* const switches[] = {&errors_, &warnings_, &events_};
  for (std::size_t k = 0; k < std::size(switches); ++k) {
    const bool chosen = named[0] || named[k + 1];
    *switches[k] = chosen ? on : *switches[k] && !(on && version_ == FmiVersion::two);
  }
  return nullptr;
}

void Log::write(bool on, fmi2Status status, int category, const std::string& text) const {
  if (!on) return;
  // number signs, which begin references to variables, are doubled, in FMI 2 also percent signs: the message
  // is a printf format
  std::string message;
  message.reserve(text.size());
  for (char c : text) {
    message += c;
    if (c == '#' || (c == '%' && logger_)) message += c;
  }
  const char* const name = log_categories[category];
  if (plain_logger_)
    plain_logger_(environment_, static_cast<fmi3Status>(status), name, message.c_str());
  else if (logger_)
    logger_(environment_, instance_name_.c_str(), status, name, message.c_str());
}

}  // namespace redysim
