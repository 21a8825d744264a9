#pragma once

#include "fmi/boundary/call_table.hpp"
#include "fmi/instance/instance.hpp"

namespace redysim {

// Non-owning reference to a function object that takes the instance and must outlive the reference.
class InstanceCall {
 public:
  template <class Call>
  InstanceCall(const Call& call)  // NOLINT(google-explicit-constructor): lambdas are passed as they are
      : call_(&call), invoke_([](const void* object, Instance& instance) {
          return (*static_cast<const Call*>(object))(instance);
        }) {}
  fmi2Status operator()(Instance& instance) const { return invoke_(call_, instance); }

 private:
  const void* call_;
  fmi2Status (*invoke_)(const void*, Instance&);
};

// Checks the call table, makes the call and converts any exception to a status and a log message.
fmi2Status guarded(Instance& instance, Function function, InstanceCall call) noexcept;

}  // namespace redysim
