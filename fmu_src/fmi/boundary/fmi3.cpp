// The C boundary of FMI 3.0: each function is one line around the instance. Functions of scheduled execution
// and clocks log one sentence and return fmi3Error.

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fmi/boundary/arrays.hpp"
#include "fmi/boundary/call_table.hpp"
#include "fmi/boundary/guarded.hpp"
#include "fmi/boundary/load_model.hpp"
#include "fmi/boundary/log.hpp"
#include "fmi/instance/instance.hpp"
#include "fmi/platform/float_mode.hpp"
#include "fmi3Functions.h"
#include "model/model_exchange.hpp"

using redysim::FloatMode;
using redysim::Function;
using redysim::Instance;
using redysim::InstanceCall;
using redysim::LoadedModel;
using redysim::Log;

static_assert(static_cast<int>(fmi3OK) == fmi2OK && static_cast<int>(fmi3Error) == fmi2Error,
              "both versions number their statuses alike");

namespace {

constexpr const char* no_schedule = "this FMU has no scheduled execution";
constexpr const char* no_clocks = "this FMU has no clocks";
constexpr const char* no_event_mode = "co-simulation has no event mode (hasEventMode = false)";
constexpr const char* no_structure = "this FMU has no structural parameters and so no configuration mode";
constexpr const char* no_elements =
    "modelDescription.xml has the dependencies (providesPerElementDependencies = false)";

fmi3Status guarded(fmi3Instance instance, Function function, InstanceCall call) noexcept {
  if (!instance) return fmi3Error;
  return static_cast<fmi3Status>(redysim::guarded(*static_cast<Instance*>(instance), function, call));
}

// Checks that there is one value for each scalar and each array element.
fmi2Status check_sizes(Instance& instance, Function function, std::size_t elements, std::size_t values) {
  if (elements == values) return fmi2OK;
  return instance.refuse(function, "the value references need " + std::to_string(elements) + " values, got " +
                                       std::to_string(values));
}

// Calls `call` if there is one value for each reference.
fmi3Status matched(fmi3Instance c, Function function, std::size_t references, std::size_t values,
                   InstanceCall call) noexcept {
  return guarded(c, function, [&](Instance& i) {
    const fmi2Status sizes = check_sizes(i, function, references, values);
    return sizes == fmi2OK ? call(i) : sizes;
  });
}

// Replaces references of arrays by those of their elements, during the lifetime of this object.
class Elements {
 public:
  Elements(const Instance& instance, const unsigned*& references, std::size_t& count) {
    if (redysim::objection_to_arrays(count, {references})) return;
    for (std::size_t i = 0; i < count; ++i) {
      if (references[i] < redysim::array_reference) continue;
      for (std::size_t k = 0; k < count; ++k) instance.append_elements(references[k], elements_);
      references = elements_.data();
      count = elements_.size();
      return;
    }
  }

 private:
  std::vector<unsigned> elements_;
};

// As `matched`, with references of arrays replaced by those of their elements.
fmi3Status matched_elements(fmi3Instance c, Function function, const unsigned*& references,
                            std::size_t& count, const std::size_t& values, InstanceCall call) noexcept {
  return guarded(c, function, [&](Instance& i) {
    const Elements elements(i, references, count);
    const fmi2Status sizes = check_sizes(i, function, count, values);
    return sizes == fmi2OK ? call(i) : sizes;
  });
}

// Logs that this FMU does not offer the function.
fmi3Status absent(fmi3Instance instance, const char* function, const char* why) noexcept {
  if (!instance) return fmi3Error;
  try {
    static_cast<Instance*>(instance)->log().error(std::string(function) + ": " + why);
  } catch (...) {
  }
  return fmi3Error;
}

// Logs that this FMU has no variables of the function's type.
fmi3Status none_of(fmi3Instance instance, const char* function, const char* variables,
                   std::size_t count) noexcept {
  if (instance && count == 0) return fmi3OK;
  return absent(instance, function, variables);
}

// Reads values. The time has the reference 0 and is not in the table.
fmi2Status get_float64(Instance& instance, const unsigned* references, std::size_t count, double* values) {
  if (const char* why = redysim::objection_to_arrays(count, {references, values}))
    return instance.refuse(Function::get_real, why);
  std::size_t first = 0;
  for (std::size_t i = 0; i <= count; ++i) {
    if (i < count && references[i] != 0) continue;
    const fmi2Status status = instance.get_real(references + first, i - first, values + first);
    if (status != fmi2OK) return status;
    if (i < count) values[i] = instance.last_successful_time();
    first = i + 1;
  }
  return fmi2OK;
}

// Creates an instance. Returns null and logs the reason if `why` names one or the model has one.
Instance* instantiated(const char* function, fmi3String name, fmi3String token, fmi3String resources,
                       fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger, bool logging_on,
                       bool model_exchange, const char* why) noexcept {
  const FloatMode ours;
  try {
    const Log log(logger, environment, logging_on);
    try {
      std::optional<LoadedModel> loaded;
      if (!why) {
        loaded = redysim::load_model(log, function, name, token, resources);
        if (!loaded) return nullptr;
        if (model_exchange) why = redysim::objection_to_model_exchange(loaded->model);
      }
      if (!why) return new Instance(log, std::move(loaded->model), std::move(loaded->guid), model_exchange);
      log.error(std::string(function) + ": " + why);
    } catch (...) {
      redysim::log_exception(log, function);
    }
  } catch (...) {
  }
  return nullptr;
}

}  // namespace

const char* fmi3GetVersion() { return fmi3Version; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean,
                                         fmi3Boolean logging_on, fmi3Boolean event_mode_used,
                                         fmi3Boolean early_return_allowed, const fmi3ValueReference[], size_t,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                         fmi3IntermediateUpdateCallback update) {
  Instance* const instance = instantiated(__func__, name, token, resources, environment, logger, logging_on,
                                          false, event_mode_used ? no_event_mode : nullptr);
  if (instance) instance->ask_for_updates({update, environment, early_return_allowed});
  return instance;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean, fmi3Boolean logging_on,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger) {
  return instantiated(__func__, name, token, resources, environment, logger, logging_on, true, nullptr);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean,
                                               fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback logger, fmi3ClockUpdateCallback,
                                               fmi3LockPreemptionCallback, fmi3UnlockPreemptionCallback) {
  return instantiated(__func__, nullptr, nullptr, nullptr, environment, logger, false, false, no_schedule);
}

void fmi3FreeInstance(fmi3Instance instance) { delete static_cast<Instance*>(instance); }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t count, const fmi3String categories[]) {
  return guarded(c, Function::set_debug_logging,
                 [&](Instance& i) { return i.set_debug_logging(on, count, categories); });
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop) {
  return guarded(c, Function::enter_initialization_mode, [&](Instance& i) {
    const fmi2Status status = i.setup_experiment(has_tolerance, tolerance, start, has_stop, stop);
    return status == fmi2OK ? i.enter_initialization_mode() : status;
  });
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
  return guarded(c, Function::exit_initialization_mode,
                 [](Instance& i) { return i.exit_initialization_mode(); });
}

fmi3Status fmi3Terminate(fmi3Instance c) {
  return guarded(c, Function::terminate, [](Instance& i) { return i.terminate(); });
}

fmi3Status fmi3Reset(fmi3Instance c) {
  return guarded(c, Function::reset, [](Instance& i) { return i.reset(); });
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 current, fmi3Float64 size, fmi3Boolean,
                      fmi3Boolean* event_needed, fmi3Boolean* terminate, fmi3Boolean* early_return,
                      fmi3Float64* last_successful_time) {
  return guarded(c, Function::do_step, [&](Instance& i) {
    if (!event_needed || !terminate || !early_return || !last_successful_time)
      return i.refuse(Function::do_step, redysim::null_pointer);
    const fmi2Status status = i.do_step(current, size);
    *event_needed = *terminate = false;
    *last_successful_time = i.last_successful_time();
    *early_return = status == fmi2OK && !redysim::is_empty_step(*last_successful_time, current + size);
    return status;
  });
}

// --- variables ---

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, fmi3Float64 values[],
                          size_t n) {
  return matched_elements(c, Function::get_real, vr, nvr, n,
                          [&](Instance& i) { return get_float64(i, vr, nvr, values); });
}

fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, fmi3Int32 values[],
                        size_t n) {
  return matched(c, Function::get_integer, nvr, n,
                 [&](Instance& i) { return i.get_integer(vr, nvr, values); });
}

fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, fmi3String values[],
                         size_t n) {
  return matched(c, Function::get_string, nvr, n, [&](Instance& i) { return i.get_string(vr, nvr, values); });
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr,
                          const fmi3Float64 values[], size_t n) {
  return matched_elements(c, Function::set_real, vr, nvr, n,
                          [&](Instance& i) { return i.set_real(vr, nvr, values); });
}

fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, const fmi3Int32 values[],
                        size_t n) {
  return matched(c, Function::set_integer, nvr, n,
                 [&](Instance& i) { return i.set_integer(vr, nvr, values); });
}

fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, const fmi3String values[],
                         size_t n) {
  return matched(c, Function::set_string, nvr, n, [&](Instance& i) { return i.set_string(vr, nvr, values); });
}

#define REDYSIM_NO_VARIABLES_OF(Type)                                                                        \
  fmi3Status fmi3Get##Type(fmi3Instance c, const fmi3ValueReference[], size_t count, fmi3##Type[], size_t) { \
    return none_of(c, __func__, "there are no " #Type " variables", count);                                  \
  }                                                                                                          \
  fmi3Status fmi3Set##Type(fmi3Instance c, const fmi3ValueReference[], size_t count, const fmi3##Type[],     \
                           size_t) {                                                                         \
    return none_of(c, __func__, "there are no " #Type " variables", count);                                  \
  }
REDYSIM_NO_VARIABLES_OF(Float32)
REDYSIM_NO_VARIABLES_OF(Int8)
REDYSIM_NO_VARIABLES_OF(UInt8)
REDYSIM_NO_VARIABLES_OF(Int16)
REDYSIM_NO_VARIABLES_OF(UInt16)
REDYSIM_NO_VARIABLES_OF(UInt32)
REDYSIM_NO_VARIABLES_OF(Int64)
REDYSIM_NO_VARIABLES_OF(UInt64)
REDYSIM_NO_VARIABLES_OF(Boolean)
#undef REDYSIM_NO_VARIABLES_OF

fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference[], size_t count, size_t[], fmi3Binary[],
                         size_t) {
  return none_of(c, __func__, "there are no Binary variables", count);
}

fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference[], size_t count, const size_t[],
                         const fmi3Binary[], size_t) {
  return none_of(c, __func__, "there are no Binary variables", count);
}

fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference[], size_t count, fmi3Clock[]) {
  return none_of(c, __func__, no_clocks, count);
}

fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference[], size_t count, const fmi3Clock[]) {
  return none_of(c, __func__, no_clocks, count);
}

// --- saved states ---

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState* saved) {
  return guarded(c, Function::get_fmu_state, [&](Instance& i) { return i.get_fmu_state(saved); });
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState saved) {
  return guarded(c, Function::set_fmu_state, [&](Instance& i) { return i.set_fmu_state(saved); });
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState* saved) {
  return guarded(c, Function::free_fmu_state, [&](Instance& i) { return i.free_fmu_state(saved); });
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState saved, size_t* size) {
  return guarded(c, Function::serialized_fmu_state_size,
                 [&](Instance& i) { return i.serialized_size(saved, size); });
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState saved, fmi3Byte bytes[], size_t size) {
  return guarded(c, Function::serialize_fmu_state,
                 [&](Instance& i) { return i.serialize(saved, reinterpret_cast<fmi2Byte*>(bytes), size); });
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState* saved) {
  return guarded(c, Function::deserialize_fmu_state, [&](Instance& i) {
    return i.deserialize(reinterpret_cast<const fmi2Byte*>(bytes), size, saved);
  });
}

// --- derivatives ---

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t nu,
                                        const fmi3ValueReference knowns[], size_t nk,
                                        const fmi3Float64 seed[], size_t seeds, fmi3Float64 sensitivity[],
                                        size_t sensitivities) {
  constexpr Function function = Function::get_directional_derivative;
  return matched_elements(c, function, knowns, nk, seeds, [&](Instance& i) {
    const Elements elements(i, unknowns, nu);
    const fmi2Status sizes = check_sizes(i, function, nu, sensitivities);
    if (sizes != fmi2OK) return sizes;
    return i.get_directional_derivative(unknowns, nu, knowns, nk, seed, sensitivity);
  });
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t nu,
                                    const fmi3ValueReference knowns[], size_t nk, const fmi3Float64 seed[],
                                    size_t seeds, fmi3Float64 sensitivity[], size_t sensitivities) {
  constexpr Function function = Function::get_adjoint_derivative;
  return matched_elements(c, function, unknowns, nu, seeds, [&](Instance& i) {
    const Elements elements(i, knowns, nk);
    const fmi2Status sizes = check_sizes(i, function, nk, sensitivities);
    if (sizes != fmi2OK) return sizes;
    return i.get_adjoint_derivative(unknowns, nu, knowns, nk, seed, sensitivity);
  });
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t n) {
  constexpr Function function = Function::get_real_output_derivatives;
  return guarded(c, function, [&](Instance& i) {
    if (const char* why = redysim::objection_to_arrays(nvr, {vr, orders, values}))
      return i.refuse(function, why);
    std::vector<unsigned> elements;
    std::vector<int> order_of;
    for (std::size_t k = 0; k < nvr; ++k) {
      i.append_elements(vr[k], elements);
      order_of.resize(elements.size(), orders[k]);
    }
    const fmi2Status sizes = check_sizes(i, function, elements.size(), n);
    if (sizes != fmi2OK) return sizes;
    return i.get_real_output_derivatives(elements.data(), n, order_of.data(), values);
  });
}

// --- functions that this FMU does not offer ---

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference, size_t*) {
  return absent(c, __func__, no_elements);
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference, size_t[], fmi3ValueReference[],
                                       size_t[], fmi3DependencyKind[], size_t) {
  return absent(c, __func__, no_elements);
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { return absent(c, __func__, no_structure); }

fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { return absent(c, __func__, no_structure); }

fmi3Status fmi3EnterStepMode(fmi3Instance c) { return absent(c, __func__, no_event_mode); }

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) {
  return absent(c, __func__, "providesEvaluateDiscreteStates = false");
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference[], size_t, fmi3Float64[],
                                  fmi3IntervalQualifier[]) {
  return absent(c, __func__, no_clocks);
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference[], size_t, fmi3UInt64[],
                                   fmi3UInt64[], fmi3IntervalQualifier[]) {
  return absent(c, __func__, no_clocks);
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference[], size_t, fmi3Float64[]) {
  return absent(c, __func__, no_clocks);
}

fmi3Status fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference[], size_t, fmi3UInt64[],
                                fmi3UInt64[]) {
  return absent(c, __func__, no_clocks);
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3Float64[]) {
  return absent(c, __func__, no_clocks);
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3UInt64[],
                                   const fmi3UInt64[]) {
  return absent(c, __func__, no_clocks);
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3Float64[]) {
  return absent(c, __func__, no_clocks);
}

fmi3Status fmi3SetShiftFraction(fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3UInt64[],
                                const fmi3UInt64[]) {
  return absent(c, __func__, no_clocks);
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference, fmi3Float64) {
  return absent(c, __func__, no_schedule);
}

// --- model exchange ---

fmi3Status fmi3EnterEventMode(fmi3Instance c) {
  return guarded(c, Function::enter_event_mode, [](Instance& i) { return i.enter_event_mode(); });
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean* again, fmi3Boolean* terminate,
                                    fmi3Boolean* new_nominals, fmi3Boolean* new_values, fmi3Boolean* has_next,
                                    fmi3Float64* next) {
  return guarded(c, Function::new_discrete_states, [&](Instance& i) {
    fmi2EventInfo info;
    const bool complete = again && terminate && new_nominals && new_values && has_next && next;
    const fmi2Status status = i.new_discrete_states(complete ? &info : nullptr);
    if (status != fmi2OK) return status;
    *again = *terminate = false;
    *new_nominals = info.nominalsOfContinuousStatesChanged;
    *new_values = info.valuesOfContinuousStatesChanged;
    *has_next = info.nextEventTimeDefined;
    *next = info.nextEventTime;
    return fmi2OK;
  });
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) {
  return guarded(c, Function::enter_continuous_time_mode,
                 [](Instance& i) { return i.enter_continuous_time_mode(); });
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean, fmi3Boolean* enter_event_mode,
                                       fmi3Boolean* terminate) {
  return guarded(c, Function::completed_integrator_step, [&](Instance& i) {
    fmi2Boolean enter = fmi2False;
    fmi2Boolean end = fmi2False;
    const fmi2Status status =
        i.completed_integrator_step(enter_event_mode ? &enter : nullptr, terminate ? &end : nullptr);
    if (status != fmi2OK) return status;
    *enter_event_mode = enter;
    *terminate = end;
    return fmi2OK;
  });
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) {
  return guarded(c, Function::set_time, [&](Instance& i) { return i.set_time(time); });
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t nx) {
  return guarded(c, Function::set_continuous_states,
                 [&](Instance& i) { return i.set_continuous_states(x, nx); });
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t nx) {
  return guarded(c, Function::get_continuous_states,
                 [&](Instance& i) { return i.get_continuous_states(x, nx); });
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 derivatives[], size_t nx) {
  return guarded(c, Function::get_derivatives,
                 [&](Instance& i) { return i.get_derivatives(derivatives, nx); });
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[], size_t nx) {
  return guarded(c, Function::get_nominals, [&](Instance& i) { return i.get_nominals(nominals, nx); });
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 indicators[], size_t ni) {
  return guarded(c, Function::get_event_indicators,
                 [&](Instance& i) { return i.get_event_indicators(indicators, ni); });
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t* count) {
  constexpr Function function = Function::get_number_of_continuous_states;
  return guarded(c, function, [&](Instance& i) { return i.get_number(function, count); });
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t* count) {
  constexpr Function function = Function::get_number_of_event_indicators;
  return guarded(c, function, [&](Instance& i) { return i.get_number(function, count); });
}
