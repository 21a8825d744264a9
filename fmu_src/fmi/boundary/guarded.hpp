#pragma once

#include <string>

#include "fmi/boundary/call_table.hpp"
#include "fmi/boundary/load_model.hpp"
#include "fmi/instance/instance.hpp"
#include "fmi/platform/float_mode.hpp"

namespace redysim {

// Checks the call table, makes the call and turns any exception into a status and a log line.
template <class Call>
fmi2Status guarded(Instance& instance, Function function, const Call& call) noexcept {
  const FloatMode ours;
  try {
    if (!is_allowed(function, instance.state()))
      return instance.refuse(function,
                             std::string("not allowed while the instance is ") + name(instance.state()));
    return call(instance);
  } catch (...) {
    log_exception(instance.log(), instance.name_of(function).c_str());
    return fmi2Error;
  }
}

}  // namespace redysim
