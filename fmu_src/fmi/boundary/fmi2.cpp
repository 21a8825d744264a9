// The C boundary of FMI 2.0: each function is one line around the instance.

#include <cstddef>
#include <cstdlib>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "fmi/boundary/call_table.hpp"
#include "fmi/boundary/guarded.hpp"
#include "fmi/boundary/load_model.hpp"
#include "fmi/boundary/log.hpp"
#include "fmi/instance/instance.hpp"
#include "fmi/platform/float_mode.hpp"
#include "fmi2Functions.h"
#include "model/model_exchange.hpp"

using redysim::FloatMode;
using redysim::Function;
using redysim::Instance;
using redysim::LoadedModel;
using redysim::Log;

namespace {

constexpr const char* instantiate_name = "fmi2Instantiate";

// The object behind an fmi2Component.
struct Component {
  Component(const Log& log, LoadedModel&& loaded, bool model_exchange, fmi2CallbackFreeMemory release_)
      : instance(log, std::move(loaded.model), std::move(loaded.guid), model_exchange), release(release_) {}
  Instance instance;
  fmi2CallbackFreeMemory release;  // frees this block
};
static_assert(alignof(Component) <= alignof(std::max_align_t),
              "the environment's memory is aligned like malloc's");

fmi2Status guarded(fmi2Component component, Function function, redysim::InstanceCall call) noexcept {
  if (!component) return fmi2Error;
  return redysim::guarded(static_cast<Component*>(component)->instance, function, call);
}

// Uses the environment's allocator, if there is one.
Component* make_component(const Log& log, LoadedModel&& loaded, bool model_exchange,
                          const fmi2CallbackFunctions* functions) {
  const bool has_memory = functions && functions->allocateMemory && functions->freeMemory;
  const fmi2CallbackFreeMemory release = has_memory ? functions->freeMemory : std::free;
  void* memory =
      has_memory ? functions->allocateMemory(1, sizeof(Component)) : std::calloc(1, sizeof(Component));
  if (!memory) throw std::bad_alloc();
  try {
    return new (memory) Component(log, std::move(loaded), model_exchange, release);
  } catch (...) {
    release(memory);
    throw;
  }
}

Component* instantiate(const Log& log, fmi2String instance_name, fmi2Type type, fmi2String guid,
                       fmi2String location, const fmi2CallbackFunctions* functions) {
  std::optional<LoadedModel> loaded =
      redysim::load_model(log, instantiate_name, instance_name, guid, location);
  if (!loaded) return nullptr;
  const bool model_exchange = type == fmi2ModelExchange;
  const char* why = model_exchange             ? redysim::objection_to_model_exchange(loaded->model)
                    : type != fmi2CoSimulation ? "fmuType is neither fmi2CoSimulation nor fmi2ModelExchange"
                                               : nullptr;
  if (why) {
    log.error(std::string(instantiate_name) + ": " + why);
    return nullptr;
  }
  return make_component(log, std::move(*loaded), model_exchange, functions);
}

}  // namespace

// Replaces libstdc++'s handler, which writes to stderr and would link the symbol demangler.
namespace __gnu_cxx {
void __verbose_terminate_handler() { std::abort(); }
}  // namespace __gnu_cxx

const char* fmi2GetTypesPlatform() { return fmi2TypesPlatform; }

const char* fmi2GetVersion() { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String instance_name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions* functions, fmi2Boolean, fmi2Boolean logging_on) {
  const FloatMode ours;
  try {
    const Log log(functions, instance_name, logging_on);
    try {
      return instantiate(log, instance_name, type, guid, location, functions);
    } catch (...) {
      redysim::log_exception(log, instantiate_name);
    }
  } catch (...) {
  }
  return nullptr;
}

void fmi2FreeInstance(fmi2Component component) {
  if (!component) return;
  Component* own = static_cast<Component*>(component);
  const fmi2CallbackFreeMemory release = own->release;
  own->~Component();
  release(own);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[]) {
  return guarded(c, Function::set_debug_logging,
                 [&](Instance& i) { return i.set_debug_logging(on, count, categories); });
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
  return guarded(c, Function::setup_experiment, [&](Instance& i) {
    return i.setup_experiment(has_tolerance, tolerance, start, has_stop, stop);
  });
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  return guarded(c, Function::enter_initialization_mode,
                 [](Instance& i) { return i.enter_initialization_mode(); });
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  return guarded(c, Function::exit_initialization_mode,
                 [](Instance& i) { return i.exit_initialization_mode(); });
}

fmi2Status fmi2Terminate(fmi2Component c) {
  return guarded(c, Function::terminate, [](Instance& i) { return i.terminate(); });
}

fmi2Status fmi2Reset(fmi2Component c) {
  return guarded(c, Function::reset, [](Instance& i) { return i.reset(); });
}

// --- variables ---

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
  return guarded(c, Function::get_real, [&](Instance& i) { return i.get_real(vr, nvr, value); });
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
  return guarded(c, Function::get_integer, [&](Instance& i) { return i.get_integer(vr, nvr, value); });
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference[], size_t nvr, fmi2Boolean[]) {
  return guarded(c, Function::get_boolean,
                 [&](Instance& i) { return i.no_booleans(Function::get_boolean, nvr); });
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
  return guarded(c, Function::get_string, [&](Instance& i) { return i.get_string(vr, nvr, value); });
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
  return guarded(c, Function::set_real, [&](Instance& i) { return i.set_real(vr, nvr, value); });
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          const fmi2Integer values[]) {
  return guarded(c, Function::set_integer, [&](Instance& i) { return i.set_integer(vr, nvr, values); });
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference[], size_t nvr, const fmi2Boolean[]) {
  return guarded(c, Function::set_boolean,
                 [&](Instance& i) { return i.no_booleans(Function::set_boolean, nvr); });
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                         const fmi2String value[]) {
  return guarded(c, Function::set_string, [&](Instance& i) { return i.set_string(vr, nvr, value); });
}

// --- saved states ---

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* saved) {
  return guarded(c, Function::get_fmu_state, [&](Instance& i) { return i.get_fmu_state(saved); });
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate saved) {
  return guarded(c, Function::set_fmu_state, [&](Instance& i) { return i.set_fmu_state(saved); });
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate* saved) {
  return guarded(c, Function::free_fmu_state, [&](Instance& i) { return i.free_fmu_state(saved); });
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate saved, size_t* size) {
  return guarded(c, Function::serialized_fmu_state_size,
                 [&](Instance& i) { return i.serialized_size(saved, size); });
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate saved, fmi2Byte bytes[], size_t size) {
  return guarded(c, Function::serialize_fmu_state,
                 [&](Instance& i) { return i.serialize(saved, bytes, size); });
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate* saved) {
  return guarded(c, Function::deserialize_fmu_state,
                 [&](Instance& i) { return i.deserialize(bytes, size, saved); });
}

// --- derivatives ---

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t nu,
                                        const fmi2ValueReference knowns[], size_t nk,
                                        const fmi2Real directions[], fmi2Real derivatives[]) {
  return guarded(c, Function::get_directional_derivative, [&](Instance& i) {
    return i.get_directional_derivative(unknowns, nu, knowns, nk, directions, derivatives);
  });
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
  return guarded(c, Function::set_real_input_derivatives,
                 [&](Instance& i) { return i.set_real_input_derivatives(vr, nvr, order, value); });
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
  return guarded(c, Function::get_real_output_derivatives,
                 [&](Instance& i) { return i.get_real_output_derivatives(vr, nvr, order, value); });
}

// --- steps ---

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real current, fmi2Real size, fmi2Boolean) {
  return guarded(c, Function::do_step, [&](Instance& i) { return i.do_step(current, size); });
}

fmi2Status fmi2CancelStep(fmi2Component c) {
  return guarded(c, Function::cancel_step, [](Instance&) { return fmi2Error; });
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status* value) {
  constexpr Function function = Function::get_status;
  return guarded(c, function, [&](Instance& i) {
    if (kind != fmi2DoStepStatus || !value)
      return i.refuse(function, "the only status of type fmi2Status is fmi2DoStepStatus");
    *value = i.last_step_status();
    return fmi2OK;
  });
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real* value) {
  constexpr Function function = Function::get_real_status;
  return guarded(c, function, [&](Instance& i) {
    if (kind != fmi2LastSuccessfulTime || !value)
      return i.refuse(function, "the only status of type Real is fmi2LastSuccessfulTime");
    *value = i.last_successful_time();
    return fmi2OK;
  });
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind, fmi2Integer*) {
  constexpr Function function = Function::get_integer_status;
  return guarded(c, function,
                 [](Instance& i) { return i.refuse(function, "there is no status of type Integer"); });
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean* value) {
  constexpr Function function = Function::get_boolean_status;
  return guarded(c, function, [&](Instance& i) {
    if (kind != fmi2Terminated || !value)
      return i.refuse(function, "the only status of type Boolean is fmi2Terminated");
    *value = fmi2False;  // the FMU never ends a simulation by itself
    return fmi2OK;
  });
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind, fmi2String*) {
  constexpr Function function = Function::get_string_status;
  return guarded(c, function, [](Instance& i) {
    return i.refuse(function,
                    "this status exists only while a step is pending; steps of this FMU are synchronous");
  });
}

// --- model exchange ---

fmi2Status fmi2EnterEventMode(fmi2Component c) {
  return guarded(c, Function::enter_event_mode, [](Instance& i) { return i.enter_event_mode(); });
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo* info) {
  return guarded(c, Function::new_discrete_states, [&](Instance& i) { return i.new_discrete_states(info); });
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
  return guarded(c, Function::enter_continuous_time_mode,
                 [](Instance& i) { return i.enter_continuous_time_mode(); });
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean, fmi2Boolean* enter_event_mode,
                                       fmi2Boolean* terminate) {
  return guarded(c, Function::completed_integrator_step,
                 [&](Instance& i) { return i.completed_integrator_step(enter_event_mode, terminate); });
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
  return guarded(c, Function::set_time, [&](Instance& i) { return i.set_time(time); });
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
  return guarded(c, Function::set_continuous_states,
                 [&](Instance& i) { return i.set_continuous_states(x, nx); });
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
  return guarded(c, Function::get_continuous_states,
                 [&](Instance& i) { return i.get_continuous_states(x, nx); });
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
  return guarded(c, Function::get_derivatives,
                 [&](Instance& i) { return i.get_derivatives(derivatives, nx); });
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t nx) {
  return guarded(c, Function::get_nominals, [&](Instance& i) { return i.get_nominals(nominals, nx); });
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t ni) {
  return guarded(c, Function::get_event_indicators,
                 [&](Instance& i) { return i.get_event_indicators(indicators, ni); });
}
