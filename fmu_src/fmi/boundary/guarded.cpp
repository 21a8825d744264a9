#include "fmi/boundary/guarded.hpp"

#include <string>

#include "fmi/boundary/load_model.hpp"
#include "fmi/platform/float_mode.hpp"

namespace redysim {

fmi2Status guarded(Instance& instance, Function function, InstanceCall call) noexcept {
  const FloatMode ours;
  try {
    if (const char* why = objection_to_kind(function, instance.is_for_model_exchange()))
      return instance.refuse(function, why);
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
